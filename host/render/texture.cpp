#include "render/texture.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace clarus::render {
namespace {

int floor_to_int(float value) {
    const int truncated = static_cast<int>(value);
    return truncated - (value < static_cast<float>(truncated));
}

uint8_t quantise(float value) { return static_cast<uint8_t>(std::clamp(value, 0.0f, 1.0f) * 255 + 0.5f); }

std::vector<Rgba> halve(const std::vector<Rgba>& fine, int coarse_size) {
    std::vector<Rgba> coarse(static_cast<size_t>(coarse_size) * coarse_size);
    for (int y = 0; y < coarse_size; ++y) {
        for (int x = 0; x < coarse_size; ++x) {
            const Rgba* top = &fine[static_cast<size_t>(2 * y) * 2 * coarse_size + 2 * x];
            const Rgba* bottom = top + 2 * coarse_size;
            const auto mean = [&](float Rgba::*c) { return (top[0].*c + top[1].*c + bottom[0].*c + bottom[1].*c) / 4; };
            coarse[static_cast<size_t>(y) * coarse_size + x] = {mean(&Rgba::r), mean(&Rgba::g), mean(&Rgba::b),
                                                                mean(&Rgba::a)};
        }
    }
    return coarse;
}

}  // namespace

Texture::Texture(int log2_size, const std::function<Rgba(float u, float v)>& image) : log2_size_(log2_size) {
    const int full = size();
    std::vector<Rgba> level(static_cast<size_t>(full) * full);
    tbb::parallel_for(0, full, [&](int y) {
        for (int x = 0; x < full; ++x) {
            level[static_cast<size_t>(y) * full + x] =
                image((static_cast<float>(x) + 0.5f) / full, (static_cast<float>(y) + 0.5f) / full);
        }
    });
    for (int extent = full;; extent /= 2) {
        level_starts_.push_back(texels_.size());
        for (const Rgba& c : level) {
            texels_.push_back(
                {quantise(std::sqrt(c.r)), quantise(std::sqrt(c.g)), quantise(std::sqrt(c.b)), quantise(c.a)});
        }
        if (extent == 1) break;
        level = halve(level, extent / 2);
    }
}

Texture::Taps Texture::taps(Imath::V2f uv, int level) const {
    const int log2_extent = log2_size_ - level;
    const int extent = 1 << log2_extent, mask = extent - 1;
    const float x = uv.x * static_cast<float>(extent) - 0.5f, y = uv.y * static_cast<float>(extent) - 0.5f;
    const int left = floor_to_int(x), top = floor_to_int(y);
    const Texel* upper = &texels_[level_starts_[level] + (static_cast<size_t>(top & mask) << log2_extent)];
    const Texel* lower = &texels_[level_starts_[level] + (static_cast<size_t>((top + 1) & mask) << log2_extent)];
    return {upper + (left & mask),       upper + ((left + 1) & mask),  lower + (left & mask),
            lower + ((left + 1) & mask), x - static_cast<float>(left), y - static_cast<float>(top)};
}

Imath::V3f Texture::bilinear(Imath::V2f uv, int level) const {
    const Taps t = taps(uv, level);
    const float w11 = t.fx * t.fy, w01 = t.fy - w11, w10 = t.fx - w11, w00 = 1 - t.fx - w01;
    const auto linear = [](uint8_t v) { return static_cast<float>(v * v); };
    const auto mix = [&](uint8_t Texel::*c) {
        return w00 * linear(t.t00->*c) + w10 * linear(t.t10->*c) + w01 * linear(t.t01->*c) + w11 * linear(t.t11->*c);
    };
    return Imath::V3f(mix(&Texel::r), mix(&Texel::g), mix(&Texel::b)) * (1 / (255.0f * 255.0f));
}

Imath::V3f Texture::sample(Imath::V2f uv, float level) const {
    if (level <= 0) return bilinear(uv, 0);
    if (level >= static_cast<float>(log2_size_)) return bilinear(uv, log2_size_);
    const int fine = static_cast<int>(level);
    const float blend = level - static_cast<float>(fine);
    return bilinear(uv, fine) * (1 - blend) + bilinear(uv, fine + 1) * blend;
}

float Texture::alpha(Imath::V2f uv) const {
    const Taps t = taps(uv, 0);
    const float upper = t.t00->a + (t.t10->a - t.t00->a) * t.fx;
    const float lower = t.t01->a + (t.t11->a - t.t01->a) * t.fx;
    return (upper + (lower - upper) * t.fy) / 255;
}

}  // namespace clarus::render
