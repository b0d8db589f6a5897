#pragma once

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>

#include "clarus/interpolator.h"
#include "clarus/upscaler.h"
#include "cli/run_state.h"
#include "io/sequence.h"

namespace clarus::cli {

/// A run into a folder, as it says so in its state.
struct Run {
    std::filesystem::path file;  // run_state_file
    std::map<std::string, std::string> settings;
    const io::Sequence& sequence;  // whole
    size_t first;                  // the first frame, also of the runs that this one goes on with
    size_t begin;                  // the first frame of this one
};

/// Keeps a run's state on the disk, from time to time and when it ends, so that it can be gone on with: never one that
/// is ahead of the pictures there. Where that fails, it warns, and the run goes on.
class Checkpoints {
  public:
    /// `interpolator` may be null. `seconds` between two states; unless told 10, and so many that they take no more
    /// than a twentieth of the time.
    Checkpoints(Run run, const Upscaler& upscaler, const Interpolator* interpolator, std::optional<double> seconds);
    /// Where a run that started over has made nothing, its state goes.
    ~Checkpoints();
    Checkpoints(const Checkpoints&) = delete;
    Checkpoints& operator=(const Checkpoints&) = delete;

    /// Before a run's first frame: its state, of no frame yet, takes the place of an earlier run's, of which pictures
    /// may be replaced from now on. Errors: file, where that cannot be removed.
    void start_over();
    /// Whether the states could be kept so far.
    bool is_kept() const { return !has_failed_; }
    /// Whether it is time for the next one.
    bool is_due() const;
    /// Takes what the run's first `frames` leave for the next; no other was submitted.
    void take(size_t frames);
    /// So many are on the disk: then what was taken after them goes there, too.
    void written(size_t frames);
    /// So many are on the disk, and no more will be: a last state, or none where the last one was the sequence's.
    void end(size_t frames);

  private:
    using Clock = std::chrono::steady_clock;

    RunState state(size_t next) const;
    void guarded(const std::function<void()>& keep);
    void write();
    void remove() const;

    const Run run_;
    const Upscaler& upscaler_;
    const Interpolator* const interpolator_;
    const std::optional<double> seconds_;
    Clock::time_point due_;
    Clock::duration cost_{};         // of the state that was taken
    std::optional<RunState> taken_;  // and is not on the disk
    size_t next_;                    // frame of the state that is there
    size_t written_ = 0;             // frames
    bool has_started_ = false;       // over
    bool has_failed_ = false;
};

}  // namespace clarus::cli
