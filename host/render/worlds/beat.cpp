#include "render/worlds/beat.h"

#include <algorithm>

namespace clarus::render {

double eased_seconds(int frames) {
    double seconds = 0;
    for (int i = 1; i <= frames; ++i) {
        const double from_edge = std::min(i, moving_frames + 1 - i) / 7.0;
        const double t = std::min(1.0, from_edge);
        seconds += time_step * t * t * (3 - 2 * t);
    }
    return seconds;
}

}  // namespace clarus::render
