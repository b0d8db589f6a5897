#include "measure/test_sequence.h"

#include <array>
#include <cmath>

#include "clarus/jitter.h"

namespace clarus::measure {
namespace {

// Positions and motion are in this part of a render pixel.
constexpr int kPixel = 256;
constexpr int kJitterCount = 16;

struct Point {
    int x, y;
};

/// A surface with a texture that moves with it.
struct Surface {
    uint32_t seed;
    Point speed;  // a frame
    float depth;
};

struct Disc {
    Surface surface;
    Point centre;  // in frame 0, in 1/1024 of the image's sides
    int radius;    // in 1/1024 of its height
};

constexpr Surface kGround{1, {-2 * kPixel - 96, kPixel / 2 + 20}, 0.8f};
constexpr std::array<Disc, 3> kDiscs{{
    {{11, {3 * kPixel + 40, -kPixel - 72}, 0.2f}, {260, 520}, 180},
    {{12, {-5 * kPixel - 8, 2 * kPixel + 56}, 0.4f}, {660, 340}, 260},
    {{13, {0, 0}, 0.6f}, {780, 800}, 140},  // which stands still
}};

/// Values from 0 to 255 at the corners of squares of so many pixels, bilinear between them.
int smooth_noise(uint32_t seed, Point at, int square) {
    const int side = square * kPixel;
    const auto whole = [&](int value) { return value >= 0 ? value / side : -((side - 1 - value) / side); };
    const int column = whole(at.x), row = whole(at.y);
    const int64_t right = at.x - column * side, down = at.y - row * side;
    const auto corner = [&](int x, int y) {
        return static_cast<int64_t>(hash(hash(hash(seed) ^ static_cast<uint32_t>(x)) ^ static_cast<uint32_t>(y)) & 255);
    };
    const int64_t above = corner(column, row) * (side - right) + corner(column + 1, row) * right;
    const int64_t below = corner(column, row + 1) * (side - right) + corner(column + 1, row + 1) * right;
    return static_cast<int>((above * (side - down) + below * down) / (int64_t{side} * side));
}

/// Broad shapes, fine grain and, here and there, hard edges.
float texture(uint32_t seed, Point at) {
    const int broad = smooth_noise(seed, at, 24), fine = smooth_noise(seed + 100, at, 3);
    const int edge = smooth_noise(seed + 200, at, 12) > 128 ? 40 : 0;
    return static_cast<float>(4 * broad + 2 * fine + 6 * edge) / (4 * 255 + 2 * 255 + 6 * 40);
}

}  // namespace

uint32_t hash(uint32_t value) {  // splitmix32's mixing
    value += 0x9e3779b9u;
    value = (value ^ (value >> 16)) * 0x85ebca6bu;
    value = (value ^ (value >> 13)) * 0xc2b2ae35u;
    return value ^ (value >> 16);
}

TestFrame test_frame(Size render, int index) {
    const Vec2 halton = halton_jitter(index, kJitterCount);
    const Point jitter{static_cast<int>(std::lround(halton.x * kPixel)),
                       static_cast<int>(std::lround(halton.y * kPixel))};
    TestFrame frame;
    frame.jitter = {static_cast<float>(jitter.x) / kPixel, static_cast<float>(jitter.y) / kPixel};
    for (int y = 0; y < render.height; ++y) {
        for (int x = 0; x < render.width; ++x) {
            const Point sample{x * kPixel + kPixel / 2 + jitter.x, y * kPixel + kPixel / 2 + jitter.y};
            const Surface* seen = &kGround;
            for (const Disc& disc : kDiscs) {
                if (disc.surface.depth > seen->depth) continue;
                const int64_t right =
                    sample.x - render.width * kPixel / 1024 * disc.centre.x - int64_t{index} * disc.surface.speed.x;
                const int64_t down =
                    sample.y - render.height * kPixel / 1024 * disc.centre.y - int64_t{index} * disc.surface.speed.y;
                const int64_t radius = int64_t{render.height} * kPixel * disc.radius / 1024;
                if (right * right + down * down <= radius * radius) seen = &disc.surface;
            }
            const Point on_surface{sample.x - index * seen->speed.x, sample.y - index * seen->speed.y};
            for (uint32_t channel = 0; channel < 3; ++channel)
                frame.color.push_back(texture(1000 * seen->seed + channel, on_surface));
            frame.depth.push_back(seen->depth);
            for (const int speed : {seen->speed.x, seen->speed.y})
                frame.motion.push_back(-static_cast<float>(speed) / kPixel);
        }
    }
    return frame;
}

}  // namespace clarus::measure
