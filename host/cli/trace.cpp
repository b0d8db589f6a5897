#include "cli/trace.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>

#include "io/file.h"

namespace clarus::cli {

void Trace::add(Track track, std::string name, std::string frame, double start, double end) {
    if (!is_kept_) return;
    const std::lock_guard lock(mutex_);
    events_.push_back({track, std::move(name), std::move(frame), start, end});
}

void Trace::add_device_spans(std::span<const StageProfile> stages, std::span<const std::string> frames) {
    double first = std::numeric_limits<double>::infinity();
    for (const StageProfile& stage : stages)
        for (const StageProfile::Span& span : stage.spans) first = std::min(first, span.start);

    for (const StageProfile& stage : stages) {
        for (const StageProfile::Span& span : stage.spans)
            if (static_cast<size_t>(span.frame) < frames.size())
                add(Track::device, stage.name, frames[span.frame], span.start - first + device_start_,
                    span.end - first + device_start_);
    }
}

void Trace::write(const std::filesystem::path& path) const {
    constexpr double microseconds = 1e6;
    nlohmann::json events = nlohmann::json::array();
    std::map<Track, std::string> names{{Track::main, "main"}, {Track::device, "device"}};
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
    const std::string text =
        nlohmann::json{{"traceEvents", events}, {"displayTimeUnit", "ms"}, {"otherData", {{"began", began.count()}}}}
            .dump() +
        "\n";
    io::write_file_atomically(path, std::as_bytes(std::span(text)));
}

}  // namespace clarus::cli
