#include "runtime/tuner.h"

#include <fmt/format.h>
#include <xxhash.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <utility>

#include "base/json_text.h"
#include "base/log.h"
#include "base/output_file.h"
#include "base/platform.h"
#include "base/private_files.h"
#include "cl/error.h"
#include "cl/event.h"
#include "clarus/error.h"
#include "runtime/launch.h"
#include "runtime/short_launches.h"
#include "runtime/tuned_table.h"
#include "runtime/tuning_file.h"

namespace clarus::runtime {
namespace {

constexpr size_t kLargestFile = size_t{1} << 26;  // bytes, of what was measured
constexpr int kRuns = 5;                          // of a candidate after its first; the shortest counts
constexpr double kGiveUpRatio = 4;  // of a first run to the best so far: the candidate is measured no further

std::string describe_choices(const Choices& choices) {
    std::string text;
    for (const auto& [name, value] : choices) text += fmt::format(" {}={}", name, value);
    return text;
}

std::vector<Selection> candidates_for(const Problem& problem, const DeviceProfile& profile) {
    std::vector<Selection> candidates;
    for (const Implementation& candidate : implementations(problem.node)) {
        if (candidate.preference(problem, profile) == 0) continue;
        for (const Choices& choices : candidate.choices(problem, profile)) candidates.push_back({&candidate, choices});
    }
    return candidates;
}

/// What of a layout decides how fast a kernel is. Of the size its magnitude: what was measured at one serves others.
std::string describe_layout(const TensorLayout& layout) {
    return fmt::format("{}x{}/{} block {}{} f{} 2^{}", layout.channels, layout.stride, layout.samples, layout.block,
                       layout.ring > 0 ? " ring" : "", 8 * bytes_of(layout.storage),
                       std::lround(std::log2(static_cast<double>(layout.width) * layout.height)));
}

/// The problem's key, and which candidates there are: one that is new is to be measured.
std::string key_of(const Problem& problem, const DeviceProfile& profile, const std::vector<Selection>& candidates) {
    std::string described;
    for (const Selection& candidate : candidates) described += candidate.describe() + '\n';
    return fmt::format("{}, {:016x}", problem_key(problem, profile), XXH3_64bits(described.data(), described.size()));
}

std::optional<Selection> named_by(const TuningResult& result, const std::vector<Selection>& candidates) {
    const auto fits = std::find_if(candidates.begin(), candidates.end(), [&](const Selection& candidate) {
        return candidate.implementation->name == result.implementation && candidate.choices == result.choices;
    });
    return fits == candidates.end() ? std::nullopt : std::optional(*fits);
}

cl::Buffer zeros(ocl::Context& context, size_t bytes) {
    cl::Buffer buffer(context.context(), CL_MEM_READ_WRITE, bytes);
    context.queue().enqueueFillBuffer(buffer, cl_uchar(0), 0, bytes);
    return buffer;
}

/// Gives up after one run where that takes many times `best`, if there is one yet.
double shortest_run(ocl::Context& context, const Problem& problem, const Selection& selection, double best) {
    const Lowered lowered = selection.lower(problem);
    return ocl::checked("measure " + selection.describe(), [&] {
        Bindings bindings;
        for (const TensorLayout& input : problem.inputs) bindings.inputs.push_back(zeros(context, memory_bytes(input)));
        bindings.output = zeros(context, memory_bytes(problem.output));
        if (lowered.packing) bindings.packed_weights = zeros(context, lowered.packing->floats * sizeof(float));

        Launch launch(Kernels(context, {&lowered.call}), lowered.call);
        launch.bind(bindings);
        const graph::Rows all = rows_of(lowered.call);
        const auto pieces =
            short_launches(lowered.call, all, most_seconds(problem, context.profile()), context.profile());
        const auto seconds = [&] {
            std::vector<cl::Event> events(pieces.size());
            for (size_t piece = 0; piece < pieces.size(); ++piece)
                launch.enqueue_rows(context.queue(), pieces[piece].first, pieces[piece].end, &events[piece]);
            double sum = 0;
            for (const cl::Event& event : events) sum += ocl::seconds_of(event);
            return sum;
        };
        double shortest = seconds();
        if (best > 0 && shortest > kGiveUpRatio * best) return shortest;
        for (int run = 0; run < kRuns; ++run) shortest = std::min(shortest, seconds());
        return shortest;
    });
}

std::string file_for(const DeviceProfile& profile) {
    const std::string identity = fmt::format("{}|{}|{}|{}|{}", profile.platform, profile.name, profile.driver_version,
                                             profile.compute_units, profile.opencl_version);
    const std::string folder = cache_directory();
    if (folder.empty()) return {};
    return fmt::format("{}/tuning/{:016x}.json", folder, XXH3_64bits(identity.data(), identity.size()));
}

}  // namespace

std::string Selection::describe() const { return implementation->name + describe_choices(choices); }

std::string problem_key(const Problem& problem, const DeviceProfile& profile) {
    std::string key = implementations(problem.node).back().name;
    for (const TensorLayout& input : problem.inputs) key += fmt::format(" of {}", describe_layout(input));
    key += fmt::format(" to {}", describe_layout(problem.output));
    const KernelCall obvious = obvious_selection(problem, profile).lower(problem).call;
    const std::string rest = obvious.options + obvious.source;  // all that layouts do not say
    return key + fmt::format(" {}{:016x}", problem.bf16 ? "bf16 " : "", XXH3_64bits(rest.data(), rest.size()));
}

std::optional<Selection> candidate_of(const TuningResult& result, const Problem& problem,
                                      const DeviceProfile& profile) {
    return named_by(result, candidates_for(problem, profile));
}

Selection built_in_selection(const Problem& problem, const DeviceProfile& profile) {
    Selection best;
    int most = 0;
    for (const Implementation& candidate : implementations(problem.node)) {
        const int preference = candidate.preference(problem, profile);
        if (preference <= most) continue;
        most = preference;
        best = {&candidate, candidate.choices(problem, profile).front()};
    }
    return best;
}

Selection obvious_selection(const Problem& problem, const DeviceProfile& profile) {
    const Implementation& obvious = implementations(problem.node).back();
    return {&obvious, obvious.choices(problem, profile).front()};
}

Tuner::Tuner(ocl::Context& context, Tuning mode) : context_(context), mode_(mode), path_(file_for(context.profile())) {
    if (mode_ == Tuning::stored || mode_ == Tuning::measure) results_ = stored();
}

Selection Tuner::select(const Problem& problem) {
    const std::vector<Selection> candidates = candidates_for(problem, context_.profile());
    if (const auto stored = stored_selection(problem, candidates)) return *stored;
    if (mode_ == Tuning::measure && context_.queue_has_profiling()) return measure(problem, candidates);
    return unmeasured(problem);
}

Selection Tuner::select_without_measuring(const Problem& problem) const {
    const auto stored = stored_selection(problem, candidates_for(problem, context_.profile()));
    return stored ? *stored : unmeasured(problem);
}

Selection Tuner::unmeasured(const Problem& problem) const {
    const DeviceProfile& profile = context_.profile();
    if (mode_ == Tuning::obvious) return obvious_selection(problem, profile);
    const TunedTable* table = TunedTable::of(profile.device_class);
    const auto tuned = table ? table->find(problem, profile) : std::nullopt;
    return tuned ? *tuned : built_in_selection(problem, profile);
}

std::optional<Selection> Tuner::stored_selection(const Problem& problem,
                                                 const std::vector<Selection>& candidates) const {
    const auto stored = results_.find(key_of(problem, context_.profile(), candidates));
    // The file may say anything.
    return stored == results_.end() ? std::nullopt : named_by(stored->second, candidates);
}

Selection Tuner::measure(const Problem& problem, const std::vector<Selection>& candidates) {
    if (candidates.size() == 1) return candidates.front();

    // A context of their own, so that programs of candidates that are not taken do not stay.
    ocl::Context scratch(context_.context(), context_.device(), context_.queue(), context_.profile());
    std::optional<Selection> best;
    double best_seconds = 0, built_in_seconds = 0;
    const std::string built_in = built_in_selection(problem, context_.profile()).describe();
    for (const Selection& candidate : candidates) {
        double seconds = 0;
        try {
            seconds = shortest_run(scratch, problem, candidate, best_seconds);
        } catch (const Error& error) {
            log(LogLevel::debug, "{}: {} cannot run here: {}", problem.node.name, candidate.describe(), error.what());
            continue;
        }
        log(LogLevel::debug, "{}: {} takes {:.3f} ms", problem.node.name, candidate.describe(), 1e3 * seconds);
        if (candidate.describe() == built_in) built_in_seconds = seconds;
        if (best && seconds >= best_seconds) continue;
        best = candidate;
        best_seconds = seconds;
    }
    if (!best) return built_in_selection(problem, context_.profile());
    results_[key_of(problem, context_.profile(), candidates)] = {best->implementation->name, best->choices,
                                                                 best_seconds, built_in_seconds};
    store();
    return *best;
}

TuningResults Tuner::stored() const {
    std::error_code none;
    if (path_.empty() || !std::filesystem::exists(std::filesystem::symlink_status(path_, none))) return {};
    const std::optional<std::string> text = read_private_file(path_, kLargestFile);
    if (!text) {
        log(LogLevel::warning, "{} is passed over: it is not a file that you own and nobody else may write", path_);
        return {};
    }
    try {
        return read_results(*text, path_);
    } catch (const Error& error) {
        log(LogLevel::warning, "{}; starting anew", error.what());
        return {};
    }
}

void Tuner::store() {
    if (path_.empty()) return;
    const auto warn = [&](std::string_view why) {
        if (!std::exchange(warned_unwritable_, true))
            log(LogLevel::warning, "cannot write {}: {}. Tuning results are not kept", path_, why);
    };
    if (!make_private_folder(std::filesystem::path(path_).parent_path()))
        return warn("its folder must be your own, and nobody else may write there");
    const FileLock lock(path_ + ".lock");
    if (!lock.is_held()) return warn("another process holds its lock");
    results_.merge(stored());  // what others have found since
    nlohmann::json document;
    document["device"] = context_.profile().name;
    document["driver"] = context_.profile().driver_version;
    for (const auto& [key, result] : results_)
        document["results"][key] = {{"implementation", result.implementation},
                                    {"choices", result.choices},
                                    {"seconds", result.seconds},
                                    {"built_in_seconds", result.built_in_seconds}};
    // A device's name may be in any encoding.
    const std::string text = json_text(document, 2) + '\n';
    try {
        OutputFile file(path_);
        file.write(std::as_bytes(std::span(text)));
        file.commit();
    } catch (const Error& error) {
        warn(error.what());
    }
}

}  // namespace clarus::runtime
