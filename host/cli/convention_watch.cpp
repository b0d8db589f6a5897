#include "cli/convention_watch.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/log.h"
#include "base/platform.h"
#include "check/first_frames.h"

namespace clarus::cli {
namespace {

std::string surely_wrong(io::Sequence sequence) {
    std::vector<io::FrameFiles>& frames = sequence.frames;
    frames.resize(std::min(frames.size(), check::most_first_frames));
    const auto lacks_motion = [](const io::FrameFiles& frame) { return frame.motion.empty(); };
    if (frames.size() < check::fewest_first_frames || std::ranges::any_of(frames, lacks_motion)) return {};
    const check::Film film = check::Film::read(std::move(sequence));
    take_idle_time();  // now: image libraries keep the threads that they make
    return check::surely_wrong(film);
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
