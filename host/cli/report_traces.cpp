#include "cli/report_traces.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "base/error.h"
#include "io/json_reader.h"

namespace clarus::cli {
namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

constexpr size_t kFrames = 8;
constexpr double kMicrosecond = 1e-6;

/// A thread of a process, of which each file has its own.
struct Track {
    size_t file;
    int64_t process, thread;
    auto operator<=>(const Track&) const = default;
};

struct Span {
    Track track;
    std::string name, frame;
    double start, end;  // seconds since 1970
};

struct Events {
    std::vector<Span> spans;
    std::map<std::tuple<size_t, int64_t>, std::string> processes;
    std::map<Track, std::string> threads;
};

void read(const fs::path& path, size_t file, Events& events) {
    constexpr double kMost = 1e18;
    constexpr int64_t kMostTracks = int64_t{1} << 53;
    const nlohmann::json trace = io::read_json(path);
    const io::JsonNode root(trace, path);
    const double began = root["otherData"]["began"].number(0, kMost);
    for (const io::JsonNode& event : root["traceEvents"].items()) {
        const std::string phase = event["ph"].text(), name = event["name"].text();
        const Track track{file, event["pid"].integer(0, kMostTracks),
                          event.find("tid") ? event["tid"].integer(0, kMostTracks) : 0};
        if (name == "process_name") events.processes[{file, track.process}] = event["args"]["name"].text();
        if (name == "thread_name") events.threads[track] = event["args"]["name"].text();
        if (phase != "X" || !event["args"].find("frame")) continue;
        const double start = (began + event["ts"].number(-kMost, kMost)) * kMicrosecond;
        events.spans.push_back(
            {track, name, event["args"]["frame"].text(), start, start + event["dur"].number(0, kMost) * kMicrosecond});
    }
}

/// Names of frames, in the order in which they began.
std::vector<std::string> chosen_frames(const std::vector<Span>& spans) {
    std::map<std::string, std::set<std::tuple<size_t, int64_t>>> processes;
    std::vector<std::string> order;
    for (const Span& span : spans) {
        auto& of_frame = processes[span.frame];
        if (of_frame.empty()) order.push_back(span.frame);
        of_frame.emplace(span.track.file, span.track.process);
    }
    size_t most = 0;
    for (const auto& [frame, parts] : processes) most = std::max(most, parts.size());
    std::erase_if(order, [&](const std::string& frame) { return processes[frame].size() < most; });
    if (order.size() <= kFrames) return order;
    const auto first = order.begin() + static_cast<ptrdiff_t>((order.size() - kFrames) / 2);
    return {first, first + kFrames};
}

}  // namespace

Json timeline_of_traces(std::span<const fs::path> files) {
    Events events;
    for (size_t file = 0; file < files.size(); ++file) read(files[file], file, events);
    std::ranges::stable_sort(events.spans, {}, &Span::start);
    const std::vector<std::string> frames = chosen_frames(events.spans);
    if (frames.empty()) fail(ErrorKind::file, "{}: no span says of which frame it is", files.front().string());

    const auto frame_of = [&](const Span& span) { return std::ranges::find(frames, span.frame) - frames.begin(); };
    std::erase_if(events.spans, [&](const Span& span) { return frame_of(span) == std::ssize(frames); });
    std::map<Track, size_t> lanes;
    for (const Span& span : events.spans) lanes[span.track] = 0;
    Json timeline{{"lanes", Json::array()}, {"spans", Json::array()}};
    std::string label;
    for (size_t file = 0; file < files.size(); ++file) label += (file == 0 ? "" : ", ") + files[file].stem().string();
    timeline["label"] = label;
    for (auto& [track, lane] : lanes) {
        lane = timeline["lanes"].size();
        const auto process = events.processes.find({track.file, track.process});
        const auto thread = events.threads.find(track);
        timeline["lanes"].push_back(fmt::format(
            "{}{}{}", process == events.processes.end() ? files[track.file].stem().string() : process->second,
            thread == events.threads.end() ? "" : ": ", thread == events.threads.end() ? "" : thread->second));
    }
    for (const Span& span : events.spans)
        timeline["spans"].push_back({{"name", span.name},
                                     {"frame", frame_of(span)},
                                     {"label", span.frame},
                                     {"lane", lanes[span.track]},
                                     {"start", span.start - events.spans.front().start},
                                     {"end", span.end - events.spans.front().start}});
    return timeline;
}

}  // namespace clarus::cli
