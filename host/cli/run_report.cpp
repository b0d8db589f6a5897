#include "cli/run_report.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "base/json_text.h"
#include "base/log.h"
#include "base/precision.h"
#include "cli/quality_text.h"
#include "io/file.h"
#include "measure/device_json.h"
#include "measure/timeline.h"

namespace clarus::cli {
namespace {

using measure::to_json;

nlohmann::ordered_json to_json(Size size) { return {size.width, size.height}; }

nlohmann::ordered_json to_json(const FrameResult& frame) {
    nlohmann::ordered_json json{
        {"name", frame.name}, {"file", frame.file.string()}, {"invalid_motion_vectors", frame.invalid_motion_vectors}};
    if (frame.quality) json.update(quality_json(*frame.quality));
    return json;
}

template <typename T>
nlohmann::ordered_json list(const std::vector<T>& items) {
    nlohmann::ordered_json json = nlohmann::ordered_json::array();
    for (const T& item : items) json.push_back(to_json(item));
    return json;
}

}  // namespace

std::optional<metrics::SequenceQuality> RunReport::quality() const {
    std::vector<metrics::FrameQuality> measured;
    for (const FrameResult& frame : frames)
        if (frame.quality) measured.push_back(*frame.quality);
    if (measured.empty()) return std::nullopt;
    return metrics::summarise(measured);
}

double RunReport::device_seconds_per_frame(int device) const {
    double seconds = 0;
    for (const StageProfile& stage : stages)
        if (stage.device == device) seconds += stage.seconds;
    return seconds;
}

void RunReport::write_json(const std::filesystem::path& path) const {
    nlohmann::ordered_json json{
        {"sequence", sequence.string()},
        {"model", {{"name", model.name()}, {"pipeline", model.pipeline()}, {"scale", model.scale()}}},
        {"devices", list(devices)},
        {"placement", measure::placement_json(placement)},
        {"precision", name_of(options.precision)},
        {"render_size", to_json(render_size)},
        {"output_size", to_json(output_size)},
        {"memory",
         {{"weights", memory.weights},
          {"arena", memory.arena},
          {"peak_live_bytes", memory.peak_live_bytes},
          {"staging", memory.staging},
          {"total", memory.total()}}},
        {"programs_compiled", programs_compiled},
        {"largest_jitter_distance", largest_jitter_distance},
        {"seconds", {{"prepare", prepare_seconds}, {"frames", frames_seconds}}},
        {"stages", measure::stages_json(stages)},
        {"timeline", measure::timeline_json(stages)},
        {"frames", list(frames)}};
    if (const auto measured = quality()) json["quality"] = quality_json(*measured);
    const std::string text = json_text(json, 2) + "\n";
    io::write_file_atomically(path, std::as_bytes(std::span(text)));
}

void RunReport::warn_of_input() const {
    size_t vectors = 0, affected = 0;
    for (const FrameResult& frame : frames) {
        vectors += frame.invalid_motion_vectors;
        affected += frame.invalid_motion_vectors > 0;
    }
    if (vectors > 0)
        log(LogLevel::warning,
            "{} motion vectors in {} of {} frames are invalid (not finite, or longer than the "
            "image's diagonal); where they are used there is no history",
            vectors, affected, frames.size());
    size_t colors = 0, colored = 0;
    for (const FrameResult& frame : frames) {
        colors += frame.colors_without_numbers;
        colored += frame.colors_without_numbers > 0;
    }
    if (colors > 0)
        log(LogLevel::warning,
            "{} pixels in {} of {} frames have a colour that is not a number (NaN), which counts as 0: black", colors,
            colored, frames.size());
    const auto beyond = std::ranges::count_if(frames, &FrameResult::is_depth_beyond_far);
    if (beyond > 0)
        log(LogLevel::warning,
            "in {} of {} frames most of the depth is above 1 and counts as 1, the far plane: depth that is linear is "
            "the "
            "view distance over the far plane's, not in metres",
            beyond, frames.size());
}

void RunReport::print_summary() const {
    std::vector<std::string> names;
    for (const DeviceProfile& device : devices) names.push_back(device.name);
    fmt::print("{} {} of {}x{} by {} on {}: {:.1f} ms a frame with reading and writing", frames.size(),
               frames.size() == 1 ? "frame" : "frames", output_size.width, output_size.height, model.name(),
               fmt::join(names, " and "), frames_seconds * 1e3 / static_cast<double>(frames.size()));
    if (!stages.empty()) {
        std::vector<std::string> times;
        for (size_t device = 0; device < devices.size(); ++device)
            times.push_back(fmt::format("{:.1f}", device_seconds_per_frame(static_cast<int>(device)) * 1e3));
        fmt::print(", {} ms on the device{}", fmt::join(times, " and "), devices.size() > 1 ? "s" : "");
    }
    fmt::print("\n");
    if (const auto measured = quality()) fmt::print("{}\n", to_text(*measured));
    warn_of_input();
}

void RunReport::print_stages() const {
    const auto rate = [](double amount, double seconds) {
        return seconds > 0 && amount > 0 ? fmt::format("{:.1f}", amount / seconds * 1e-9) : std::string("-");
    };
    const bool several = devices.size() > 1;
    const auto whose = [&](int device) {
        return !several ? std::string() : device < 0 ? std::string("-") : fmt::to_string(device);
    };
    size_t stage_width = 5, kernel_width = 6;
    for (const StageProfile& stage : stages) {
        stage_width = std::max(stage_width, stage.name.size());
        kernel_width = std::max(kernel_width, stage.kernel.size());
    }
    const auto row = [&](const std::string& device, const std::string& stage, const std::string& kernel,
                         const std::string& time, const std::string& operations, const std::string& bytes) {
        if (several) fmt::print("{:<6}  ", device);
        fmt::print("{:<{}}  {:<{}}  {:>8}  {:>8}  {:>8}\n", stage, stage_width, kernel, kernel_width, time, operations,
                   bytes);
    };
    row("device", "stage", "kernel", "ms", "GFLOP/s", "GB/s");
    for (const StageProfile& stage : stages)
        row(whose(stage.device), stage.name, stage.kernel, fmt::format("{:.3f}", stage.seconds * 1e3),
            rate(stage.operations, stage.seconds), rate(stage.bytes, stage.seconds));
    const auto sum = [&](int device, const std::string& name) {
        double operations = 0, bytes = 0;
        for (const StageProfile& stage : stages) {
            if (stage.device != device) continue;
            operations += stage.operations;
            bytes += stage.bytes;
        }
        const double seconds = device_seconds_per_frame(device);
        row(whose(device), name, "", fmt::format("{:.3f}", seconds * 1e3), rate(operations, seconds),
            rate(bytes, seconds));
    };
    for (size_t device = 0; device < devices.size(); ++device) sum(static_cast<int>(device), "frame");
    if (several) sum(-1, "transfers");
}

}  // namespace clarus::cli
