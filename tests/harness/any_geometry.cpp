#include "any_geometry.h"

#include <algorithm>
#include <cmath>

namespace clarus::test {

std::array<Tap, 4> taps_around(Point point) {
    const double left = std::floor(point.x), top = std::floor(point.y);
    const double right = point.x - left, below = point.y - top;
    const int x = static_cast<int>(left), y = static_cast<int>(top);
    return {{{x, y, 1 - right, 1 - below},
             {x + 1, y, right, 1 - below},
             {x, y + 1, 1 - right, below},
             {x + 1, y + 1, right, below}}};
}

bool is_valid(const Planes& motion, int x, int y) {
    return std::isfinite(motion.at(0, x, y)) && std::isfinite(motion.at(1, x, y));
}

bool is_inside(const graph::Shape& shape, int x, int y) {
    return x >= 0 && y >= 0 && x < shape.width && y < shape.height;
}

Point previous_place(const Planes& motion, int x, int y, Vec2 jitter, double share) {
    const double far = 1e6;
    return {std::clamp(x + double(jitter.x) + share * motion.at(0, x, y), -far, far),
            std::clamp(y + double(jitter.y) + share * motion.at(1, x, y), -far, far)};
}

Planes expected_previous_depth(const Planes& motion, const Planes& depth, Vec2 jitter, double share) {
    Planes result = planes(depth.shape, [](int, int, int) { return 1.0f; });
    for (int y = 0; y < depth.shape.height; ++y)
        for (int x = 0; x < depth.shape.width; ++x) {
            if (!is_valid(motion, x, y)) continue;
            for (const Tap& tap : taps_around(previous_place(motion, x, y, jitter, share)))
                if (is_inside(depth.shape, tap.x, tap.y) && tap.weight() > 0.1)
                    result.at(0, tap.x, tap.y) = std::min(result.at(0, tap.x, tap.y), depth.at(0, x, y));
        }
    return result;
}

Planes any_motion(graph::Shape size, std::mt19937& random) {
    std::uniform_int_distribution kinds(0, 15), eighths(-24, 24), near(-1, 1);
    Planes motion = planes({2, size.height, size.width}, [](int, int, int) { return 0.0f; });
    std::array<float, 2> vector{};
    for (int y = 0; y < size.height; ++y)
        for (int x = 0; x < size.width; ++x) {
            const int kind = kinds(random);
            if (kind < 3) vector = {eighths(random) / 8.0f, eighths(random) / 8.0f};
            if (kind < 9) vector[kind % 2] += near(random) / 16.0f;
            for (int c = 0; c < 2; ++c) motion.at(c, x, y) = vector[c];
            if (kind == 10) motion.at(near(random) > 0, x, y) = kNan;
            if (kind == 11) motion.at(0, x, y) = near(random) > 0 ? kInfinity : -kInfinity;
            if (kind == 12) motion.at(1, x, y) = near(random) > 0 ? 1e30f : -3e9f;
            if (kind == 13) motion.at(0, x, y) = near(random) * static_cast<float>(size.width);
        }
    return motion;
}

Planes any_depth(graph::Shape size, std::mt19937& random) {
    std::uniform_int_distribution levels(0, 4), changes(0, 3);
    float level = 0.5f, sloping = 0;
    return planes({1, size.height, size.width}, [&](int, int x, int y) {
        if (changes(random) == 0) level = static_cast<float>(levels(random)) / 5;
        if (changes(random) == 0) sloping = static_cast<float>(levels(random)) / 1024;
        return std::min(level + sloping * static_cast<float>(x + y), 1.0f);
    });
}

runtime::FrameConstants frame_with(Vec2 jitter, Vec2 motion_jitter) {
    runtime::FrameConstants frame;
    frame.jitter_x = jitter.x;
    frame.jitter_y = jitter.y;
    frame.motion_jitter_x = motion_jitter.x;
    frame.motion_jitter_y = motion_jitter.y;
    return frame;
}

}  // namespace clarus::test
