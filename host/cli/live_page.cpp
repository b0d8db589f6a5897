#include "cli/live_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <map>
#include <nlohmann/json.hpp>
#include <span>
#include <system_error>
#include <utility>

#include "base/error.h"
#include "base/explain.h"
#include "base/hash.h"
#include "base/log.h"
#include "cli/image_folder.h"
#include "cli/interrupt.h"
#include "cli/run_file.h"
#include "io/image.h"
#include "io/image_folder.h"
#include "metrics/blocks.h"
#include "report/page.h"

namespace clarus::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::chrono::seconds measuring{1};      // at a time
constexpr std::chrono::seconds figures_apart{5};  // pages that differ in figures alone

/// Another one where a file has been written anew. Empty where there is none.
std::string stamp_of(const fs::path& file) {
    std::error_code none, other;
    const auto time = fs::last_write_time(file, none);
    const auto size = fs::file_size(file, other);
    return none || other ? "" : fmt::format("{}:{} ", time.time_since_epoch().count(), size);
}

/// Another one where a file has come into a folder or has left it.
std::string stamp_of_folder(const fs::path& folder) {
    std::error_code none;
    const auto time = fs::last_write_time(folder, none);
    return none ? "" : fmt::format("{} {} ", folder.string(), time.time_since_epoch().count());
}

/// None where there is none yet.
std::map<std::string, fs::path> images_so_far(const fs::path& folder) {
    if (!fs::is_directory(folder)) fail(ErrorKind::file, "{} is no folder", folder.string());
    return io::holds_images(folder) ? io::images_in(folder) : std::map<std::string, fs::path>{};
}

std::vector<Reference> frames_of(const fs::path& result) {
    std::vector<Reference> frames;
    const io::Sequence images = io::read_images(result, 1);
    for (const io::FrameFiles& image : images.frames)
        frames.push_back({image.name, {}, images.color_space, 1, frames.size(), nullptr});
    return frames;
}

}  // namespace

LivePage::LivePage(Settings settings) : settings_(std::move(settings)), names_(names_of(settings_.results)) {
    if (!settings_.reference.sequence.path.empty()) {
        references_ = read_frames(settings_.reference);
        has_references_ = !references_.front().file.empty();
    }
    look();
    publish();
}

std::shared_ptr<const report::ServedPage> LivePage::page() {
    is_asked_ = true;
    const std::lock_guard lock(mutex_);
    return page_;
}

void LivePage::update() {
    if (!is_asked_.exchange(false)) return;
    try {
        look();
        if (state_ != published_) publish();
        measure();
        const bool has_figures = comparison_ && comparison_->measured() != published_measured_;
        if (has_figures && (is_measured() || Clock::now() - published_at_ > figures_apart)) publish();
        last_warning_.clear();
    } catch (const std::exception& error) {
        comparison_.reset();
        stamps_.clear();  // begins anew when it looks again
        state_.clear();
        if (const std::string warning = explain(error); std::exchange(last_warning_, warning) != warning)
            log(LogLevel::warning, "the page stays as it is: {}", warning);
    }
}

void LivePage::look() {
    std::vector<std::map<std::string, fs::path>> images;
    for (const fs::path& result : settings_.results) images.push_back(images_so_far(result));
    const bool has_sequence = !settings_.reference.sequence.path.empty();
    if (!has_sequence && !images.front().empty()) references_ = frames_of(settings_.results.front());

    std::vector<Reference> shown;
    std::vector<std::string> stamps;
    std::vector<std::vector<fs::path>> pictures(images.size());
    for (const Reference& frame : references_) {
        const auto has_it = [&](const auto& all) { return all.contains(frame.name); };
        if (!std::ranges::all_of(images, has_it)) continue;
        shown.push_back(frame);
        stamps.push_back(frame.name + " ");
        for (size_t i = 0; i < images.size(); ++i) {
            pictures[i].push_back(images[i].at(frame.name));
            stamps.back() += stamp_of(pictures[i].back());
        }
    }
    const bool has_grown =
        stamps_.size() <= stamps.size() && std::equal(stamps_.begin(), stamps_.end(), stamps.begin());
    if (!has_grown) comparison_.reset();
    if (has_references_ && !shown.empty()) {
        const size_t before = comparison_ ? shown_.size() : 0;
        if (!comparison_) comparison_ = std::make_unique<Comparison>(settings_.results, settings_.reference);
        comparison_->add(std::span(shown).subspan(before));
    }
    std::string state;
    for (const std::string& stamp : stamps) state += stamp;
    for (const fs::path& result : settings_.results) {
        state += "run " + stamp_of(run_file(result));
        for (const fs::path& folder : view_folders(result)) state += stamp_of_folder(folder);
    }
    shown_ = std::move(shown);
    stamps_ = std::move(stamps);
    pictures_ = std::move(pictures);
    state_ = hexadecimal(hash_of(state));
}

void LivePage::measure() {
    const Clock::time_point end = Clock::now() + measuring;
    while (!is_measured() && Clock::now() < end && !Interrupt::came()) comparison_->measure_next();
}

void LivePage::publish() {
    Json json = data();
    const size_t measured = comparison_ ? comparison_->measured() : 0;
    const std::string version = fmt::format("{}-{}", state_, measured);
    json["version"] = version;
    auto page = std::make_shared<const report::ServedPage>(version, report::page(json));
    published_ = state_;
    published_measured_ = measured;
    published_at_ = Clock::now();
    const std::lock_guard lock(mutex_);
    page_ = std::move(page);
}

Json LivePage::data() {
    const fs::path& sequence = settings_.reference.sequence.path;
    Json data{{"title", !settings_.title.empty() ? settings_.title
                        : sequence.empty()       ? names_.front()
                                                 : name_of(sequence)},
              {"frames", Json::array()},
              {"benches", Json::array()},
              {"results", Json::array()}};
    for (const Reference& frame : shown_) data["frames"].push_back(frame.name);
    if (!shown_.empty()) add_results(data);
    return data;
}

void LivePage::add_results(Json& data) {
    cache_.age();
    const Pictures pictures(shown_, steadily_spaced(shown_.size(), settings_.pictures), settings_.lossless, &cache_);
    data["lossless"] = settings_.lossless;
    data["pictured"] = pictures.indices();
    Json sources = Json::array();
    if (const auto& sequence = shown_.front().sequence) {
        data["render_size"] = {sequence->render_size.width, sequence->render_size.height};
        sources.push_back(
            pictures.source("input", "input", [&](size_t i) { return sequence->frames[shown_[i].index].color; }));
    }
    std::vector<ComparedResult> compared;
    if (comparison_ && comparison_->measured() > 0) compared = comparison_->results();
    for (size_t k = 0; k < names_.size(); ++k) {
        sources.push_back(pictures.source(names_[k], "result", [&](size_t i) { return pictures_[k][i]; }));
        data["output_size"] = sources.back()["size"];
        Json quality{{"frames", Json::array()}}, places = Json::array();
        if (!compared.empty()) {
            quality = comparison_json(compared[k], shown_);
            places = worst_places(compared[k], pictures.indices());
        }
        for (size_t i = quality["frames"].size(); i < shown_.size(); ++i)
            quality["frames"].push_back({{"name", shown_[i].name}});
        data["results"].push_back({{"name", names_[k]},
                                   {"quality", std::move(quality)},
                                   {"run", read_run(settings_.results[k])},
                                   {"places", std::move(places)}});
    }
    add_views(pictures, sources);
    if (has_references_) {
        sources.push_back(pictures.source("reference", "reference", [&](size_t i) { return shown_[i].file; }));
        data["output_size"] = sources.back()["size"];
    }
    data["block"] = metrics::BlockErrors::side;
    data["sources"] = std::move(sources);
}

/// A view's picture comes after the frame's: until all are there, the view is left out.
void LivePage::add_views(const Pictures& pictures, Json& sources) const {
    for (size_t k = 0; k < names_.size(); ++k)
        for (const fs::path& folder : view_folders(settings_.results[k])) {
            const auto images = images_so_far(folder);
            const auto has_it = [&](size_t i) { return images.contains(shown_[i].name); };
            if (std::ranges::all_of(pictures.indices(), has_it))
                sources.push_back(pictures.source(
                    fmt::format("{}: {}", names_[k], folder.filename().string()), "view",
                    [&](size_t i) { return images.at(shown_[i].name); }, true));
        }
}

}  // namespace clarus::cli
