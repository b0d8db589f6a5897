#include "cli/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

namespace clarus::cli {
namespace {

constexpr auto quiet_time = std::chrono::seconds(2);
constexpr auto redraw_interval = std::chrono::milliseconds(100);
constexpr int bar_width = 30;
constexpr const char* erase_line = "\r\033[K";

}  // namespace

Progress::Progress(std::string label) : label_(std::move(label)), terminal_(isatty(STDERR_FILENO)) {}

Progress::~Progress() {
    if (visible_) fmt::print(stderr, "{}", erase_line);
}

void Progress::update(double fraction) {
    const Clock::time_point now = Clock::now();
    if (!terminal_ || now - start_ < quiet_time || now - drawn_ < redraw_interval) return;
    drawn_ = now;
    visible_ = true;

    fraction = std::clamp(fraction, 0.0, 1.0);
    const int filled = static_cast<int>(std::lround(fraction * bar_width));
    const double elapsed = std::chrono::duration<double>(now - start_).count();
    std::string left;
    if (fraction > 0) {
        const int seconds = static_cast<int>(std::lround(elapsed / fraction - elapsed));
        left = fmt::format("{}:{:02} left", seconds / 60, seconds % 60);
    }
    fmt::print(stderr, "{}{} [{:=<{}}{: <{}}] {:3.0f} % {}", erase_line, label_, "", filled, "", bar_width - filled,
               fraction * 100, left);
    std::fflush(stderr);
}

}  // namespace clarus::cli
