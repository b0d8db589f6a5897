#include "cli/trace.h"

#include <fmt/format.h>

#include <map>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/json_text.h"
#include "io/file.h"

namespace clarus::cli {

void Trace::add(Track track, std::string name, std::string frame, double start, double end) {
    if (!is_kept_) return;
    const std::lock_guard lock(mutex_);
    events_.push_back({track, std::move(name), std::move(frame), start, end});
}

void Trace::add_device_spans(std::span<const StageProfile> stages, std::span<const DeviceProfile> devices,
                             std::span<const std::string> frames) {
    const double origin = std::chrono::duration<double>(origin_.time_since_epoch()).count();
    for (const StageProfile& stage : stages) {
        const Track track =
            stage.device < 0 ? Track::transfers : Track{static_cast<int>(Track::first_device) + stage.device};
        devices_[track] =
            stage.device < 0 ? "transfers" : fmt::format("device {}: {}", stage.device, devices[stage.device].name);
        for (const StageProfile::Span& span : stage.spans)
            if (static_cast<size_t>(span.frame) < frames.size())
                add(track, stage.name, frames[span.frame], span.start - origin, span.end - origin);
    }
}

void Trace::write(const std::filesystem::path& path) const {
    constexpr double microseconds = 1e6;
    nlohmann::json events = nlohmann::json::array();
    std::map<Track, std::string> names = devices_;
    names[Track::main] = "main";
    for (const Event& event : events_)
        if (event.track >= Track::first_writer)
            names[event.track] =
                fmt::format("writer {}", static_cast<int>(event.track) - static_cast<int>(Track::first_writer) + 1);
    for (const auto& [track, name] : names)
        events.push_back(
            {{"name", "thread_name"}, {"ph", "M"}, {"pid", 1}, {"tid", track}, {"args", {{"name", name}}}});
    for (const Event& event : events_)
        events.push_back({{"name", event.name},
                          {"ph", "X"},
                          {"pid", 1},
                          {"tid", event.track},
                          {"ts", event.start * microseconds},
                          {"dur", (event.end - event.start) * microseconds},
                          {"args", {{"frame", event.frame}}}});
    const std::chrono::duration<double, std::micro> began = began_.time_since_epoch();
    const nlohmann::json json{
        {"traceEvents", events}, {"displayTimeUnit", "ms"}, {"otherData", {{"began", began.count()}}}};
    const std::string text = json_text(json) + "\n";
    io::write_file_atomically(path, std::as_bytes(std::span(text)));
}

}  // namespace clarus::cli
