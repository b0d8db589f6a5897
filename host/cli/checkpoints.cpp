#include "cli/checkpoints.h"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <utility>

#include "base/error.h"
#include "base/log.h"

namespace clarus::cli {
namespace {

using Seconds = std::chrono::duration<double>;
constexpr Seconds kUsual{10};
constexpr int kShare = 20;  // of the time, one part in so many

}  // namespace

Checkpoints::Checkpoints(Run run, const Upscaler& upscaler, const Interpolator* interpolator,
                         std::optional<double> seconds)
    : run_(std::move(run)),
      upscaler_(upscaler),
      interpolator_(interpolator),
      seconds_(seconds),
      due_(Clock::now() + std::chrono::duration_cast<Clock::duration>(Seconds(seconds.value_or(kUsual.count())))),
      next_(run_.begin) {}

Checkpoints::~Checkpoints() {
    if (has_started_ && written_ == 0) remove();
}

void Checkpoints::start_over() {
    std::error_code error;
    if (std::filesystem::remove(run_.file, error))
        fmt::print(
            "starting over: an earlier run into this folder had not ended, --resume would have gone on with it\n");
    else if (error)
        fail(ErrorKind::file, "cannot remove {}: {}", run_.file.string(), error.message());
    has_started_ = true;
    guarded([&] { write_run_state(run_.file, state(run_.begin)); });
}

bool Checkpoints::is_due() const { return !taken_ && !has_failed_ && Clock::now() >= due_; }

RunState Checkpoints::state(size_t next) const {
    return {run_.settings,
            run_.first,
            next,
            digest_of(run_.sequence, run_.first, next),
            upscaler_.save_history(),
            interpolator_ ? interpolator_->save_history() : std::vector<std::byte>()};
}

void Checkpoints::guarded(const std::function<void()>& keep) {
    const Clock::time_point start = Clock::now();
    try {
        keep();
    } catch (const std::exception& error) {
        taken_.reset();
        has_failed_ = true;
        log(LogLevel::warning, "the run's state was not kept, --resume goes on from the one before or starts over: {}",
            error.what());
    }
    cost_ += Clock::now() - start;
}

void Checkpoints::take(size_t frames) {
    const size_t next = run_.begin + frames;
    if (next == next_) return;
    cost_ = {};
    guarded([&] { taken_ = state(next); });
    write();
}

void Checkpoints::written(size_t frames) {
    written_ = frames;
    write();
}

void Checkpoints::write() {
    if (!taken_ || taken_->next > run_.begin + written_) return;
    guarded([&] {
        write_run_state(run_.file, *taken_);
        next_ = taken_->next;
    });
    taken_.reset();
    const Seconds between = seconds_ ? Seconds(*seconds_) : std::max<Seconds>(kUsual, kShare * cost_);
    due_ = Clock::now() + std::chrono::duration_cast<Clock::duration>(between);
}

void Checkpoints::end(size_t frames) {
    if (run_.begin + frames < run_.sequence.frames.size()) return take(frames);
    taken_.reset();
    remove();
}

void Checkpoints::remove() const {
    std::error_code error;
    std::filesystem::remove(run_.file, error);
    if (error) log(LogLevel::warning, "cannot remove {}: {}", run_.file.string(), error.message());
}

}  // namespace clarus::cli
