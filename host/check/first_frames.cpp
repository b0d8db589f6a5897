#include "check/first_frames.h"

#include <fmt/format.h>
#include <sched.h>

#include "check/check.h"

namespace clarus::check {

std::string surely_wrong(const Film& film) {
    constexpr size_t pixels = 600;  // of a pair of frames
    std::string text;
    for (const Finding& one : judge(measure(film, pixels), film.sequence).findings)
        if (one.verdict == Verdict::wrong)
            text += fmt::format("{}{} is {}, and {} fits better", text.empty() ? "" : "; ", one.field, one.declared,
                                one.best);
    return text;
}

void take_idle_time() {
    const sched_param none{};
    sched_setscheduler(0, SCHED_IDLE, &none);  // where it fails, the thread takes its share as others do
}

}  // namespace clarus::check
