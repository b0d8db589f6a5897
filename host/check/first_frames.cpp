#include "check/first_frames.h"

#include <fmt/format.h>

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

}  // namespace clarus::check
