#pragma once

#include <fmt/format.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "clarus/upscaler.h"

namespace clarus::cli {

/// What frames of a stream are called, by their number.
inline std::string frame_name(uint64_t number) { return fmt::format("{:04}", number); }

/// Who did what when, for the Chrome trace viewer (chrome://tracing, ui.perfetto.dev). Thread-safe.
class Trace {
  public:
    enum class Track { main = 1, transfers, first_device = 10, first_writer = 1000 };

    /// Where nobody is to see it, it keeps nothing.
    explicit Trace(bool is_kept) : is_kept_(is_kept) {}

    /// Each frame that is written while others are has a track of its own, from 0.
    static Track writer(size_t index) { return Track{static_cast<int>(Track::first_writer) + static_cast<int>(index)}; }

    /// Adds itself to the trace at the end of its life, where it is of a frame. `trace` must outlive it.
    class Span {
      public:
        Span(Trace& trace, Track track, std::string name) : Span(trace, track, std::move(name), "") {}
        Span(Trace& trace, Track track, std::string name, std::string frame)
            : trace_(trace), track_(track), name_(std::move(name)), frame_(std::move(frame)), start_(trace.now()) {}
        ~Span() {
            if (!frame_.empty()) trace_.add(track_, name_, frame_, start_, trace_.now());
        }
        Span(const Span&) = delete;
        Span& operator=(const Span&) = delete;
        /// Of which frame it was may be known later.
        void set_frame(std::string frame) { frame_ = std::move(frame); }

      private:
        Trace& trace_;
        Track track_;
        std::string name_, frame_;
        double start_;
    };

    /// The stages' spans, one a frame, with a track for each device that has some.
    void add_device_spans(std::span<const StageProfile> stages, std::span<const DeviceProfile> devices,
                          std::span<const std::string> frames);

    /// When it began, on the clock of all processes, is in "otherData". Errors: file.
    void write(const std::filesystem::path& path) const;

  private:
    using Clock = std::chrono::steady_clock;
    struct Event {
        Track track;
        std::string name, frame;
        double start, end;  // seconds since the trace began
    };

    double now() const { return std::chrono::duration<double>(Clock::now() - origin_).count(); }
    void add(Track track, std::string name, std::string frame, double start, double end);

    bool is_kept_;
    Clock::time_point origin_ = Clock::now();
    std::chrono::system_clock::time_point began_ = std::chrono::system_clock::now();
    std::mutex mutex_;
    std::map<Track, std::string> devices_;  // names of tracks
    std::vector<Event> events_;
};

}  // namespace clarus::cli
