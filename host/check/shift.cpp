#include "check/shift.h"

#include <cmath>

namespace clarus::check {
namespace {

/// Where a pixel was, without the jitter's change.
Vec2 moved(const Film& film, const io::Pixels* motion, const Reading& reading, int x, int y, Size size) {
    Vec2 move;
    if (motion) move = reading.displacement({motion->at(x, y, 0), motion->at(x, y, 1)}, size, film.sequence.scale);
    return {static_cast<float>(x) + move.x, static_cast<float>(y) + move.y};
}

}  // namespace

Vec2 measure_shift(const Film& film, Pair pair, const Reading& reading) {
    constexpr float unexplained = 0.08f;  // differences that are no shift's
    constexpr int steps = 4;
    const Plane &before = film.luma[pair.before], &now = film.luma[pair.frame];
    const io::Pixels* motion = film.motion_of(pair.frame, reading);
    const Vec2 nothing{NAN, NAN};
    if (before.size != now.size || (film.has_motion() && !motion)) return nothing;
    Vec2 shift;
    for (int i = 0; i < steps; ++i) {
        double xx = 0, xy = 0, yy = 0, xe = 0, ye = 0;
        for (int y = 1; y + 1 < now.size.height; ++y)
            for (int x = 1; x + 1 < now.size.width; ++x) {
                const Vec2 from = moved(film, motion, reading, x, y, now.size);
                const float u = from.x + shift.x, v = from.y + shift.y;
                if (!before.contains(u, v)) continue;
                const double error = now.at(x, y) - sample(before, u, v);
                if (std::abs(error) > unexplained) continue;
                const double gx = (now.at(x + 1, y) - now.at(x - 1, y)) / 2;
                const double gy = (now.at(x, y + 1) - now.at(x, y - 1)) / 2;
                xx += gx * gx;
                xy += gx * gy;
                yy += gy * gy;
                xe += gx * error;
                ye += gy * error;
            }
        const double determinant = xx * yy - xy * xy;
        constexpr double least = 1e-6;  // squares of gradients of luma
        if (!(determinant > least * least) || !(determinant > 1e-4 * xx * yy)) return nothing;
        shift.x += static_cast<float>((yy * xe - xy * ye) / determinant);
        shift.y += static_cast<float>((xx * ye - xy * xe) / determinant);
    }
    return shift;
}

io::Pixels warped(const Film& film, Pair pair, const Reading& reading, const io::Pixels& before) {
    const std::optional<Vec2> change = film.jitter_change(pair.before, pair.frame, reading.jitter_frame);
    const Vec2 shift = reading.shift(change.value_or(Vec2{}));
    const io::Pixels* motion = film.motion_of(pair.frame, reading);
    io::Pixels result{before.size, before.channels, std::vector<float>(before.values.size())};
    Plane plane{before.size, std::vector<float>(before.values.size() / static_cast<size_t>(before.channels))};
    for (int channel = 0; channel < before.channels; ++channel) {
        for (size_t i = 0; i < plane.values.size(); ++i)
            plane.values[i] = before.values[i * static_cast<size_t>(before.channels) + static_cast<size_t>(channel)];
        for (int y = 0; y < before.size.height; ++y)
            for (int x = 0; x < before.size.width; ++x) {
                const Vec2 from = moved(film, motion, reading, x, y, before.size);
                const float u = from.x + shift.x, v = from.y + shift.y;
                if (plane.contains(u, v)) result.at(x, y, channel) = sample(plane, u, v);
            }
    }
    return result;
}

}  // namespace clarus::check
