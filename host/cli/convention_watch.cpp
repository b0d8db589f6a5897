#include "cli/convention_watch.h"

#include <fmt/format.h>
#include <sched.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/log.h"
#include "check/check.h"

namespace clarus::cli {
namespace {

// Threads that this one makes are alike. Reading comes before, for image libraries keep the threads that they make.
void take_idle_time() {
    const sched_param none{};
    sched_setscheduler(0, SCHED_IDLE, &none);  // where it fails, the thread takes its share as others do
}

std::string surely_wrong(io::Sequence sequence) {
    constexpr size_t least_frames = 4, most_frames = 8, pixels = 600;
    std::vector<io::FrameFiles>& frames = sequence.frames;
    frames.resize(std::min(frames.size(), most_frames));
    const auto lacks_motion = [](const io::FrameFiles& frame) { return frame.motion.empty(); };
    if (frames.size() < least_frames || std::ranges::any_of(frames, lacks_motion)) return {};
    const check::Film film = check::Film::read(std::move(sequence));
    take_idle_time();
    std::string text;
    for (const check::Finding& one : check::judge(check::measure(film, pixels), film.sequence).findings)
        if (one.verdict == check::Verdict::wrong)
            text += fmt::format("{}{} is {}, and {} fits better", text.empty() ? "" : "; ", one.field, one.declared,
                                one.best);
    return text;
}

}  // namespace

std::future<void> watch_conventions(const io::Sequence& sequence, std::string name) {
    return std::async(std::launch::async, [&sequence, name = std::move(name)] {
        try {
            if (const std::string wrong = surely_wrong(sequence); !wrong.empty())
                log(LogLevel::warning, "{}: in the first frames, {}. clarus check tells more; --no-check does not look",
                    name, wrong);
        } catch (const Error&) {
        }
    });
}

}  // namespace clarus::cli
