#include "render/texture.h"

#include <OpenImageIO/imagebuf.h>
#include <OpenImageIO/imagebufalgo.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <ranges>
#include <utility>

#include "base/error.h"
#include "base/srgb.h"
#include "io/image.h"

namespace clarus::render {
namespace {

using Imath::V2f;
using Imath::V4f;

int floor_to_int(float value) {
    const int truncated = static_cast<int>(value);
    return truncated - (value < static_cast<float>(truncated));
}

uint8_t quantise(float linear) { return static_cast<uint8_t>(std::sqrt(std::clamp(linear, 0.0f, 1.0f)) * 255 + 0.5f); }

/// A level of a pyramid while it is made: colours multiplied by alpha, so that holes lend no colour to their
/// surroundings.
struct Level {
    int width, height;
    std::vector<V4f> texels;

    V4f& at(int x, int y) { return texels[static_cast<size_t>(y) * width + x]; }
    const V4f& at(int x, int y) const { return texels[static_cast<size_t>(y) * width + x]; }
};

Level halved(const Level& fine) {
    Level coarse{std::max(1, fine.width / 2), std::max(1, fine.height / 2), {}};
    coarse.texels.reserve(static_cast<size_t>(coarse.width) * coarse.height);
    for (int y = 0; y < coarse.height; ++y) {
        const int top = 2 * y, bottom = std::min(top + 1, fine.height - 1);
        for (int x = 0; x < coarse.width; ++x) {
            const int left = 2 * x, right = std::min(left + 1, fine.width - 1);
            coarse.texels.push_back(
                (fine.at(left, top) + fine.at(right, top) + fine.at(left, bottom) + fine.at(right, bottom)) / 4);
        }
    }
    return coarse;
}

/// Colours as they are stored: no longer multiplied by alpha; those of holes from the next level, where it has some.
void unassociate(Level& level, const Level* coarse) {
    for (int y = 0; y < level.height; ++y) {
        for (int x = 0; x < level.width; ++x) {
            V4f& texel = level.at(x, y);
            const float alpha = texel.w;
            if (alpha > 0) {
                texel = {texel.x / alpha, texel.y / alpha, texel.z / alpha, alpha};
            } else if (coarse) {
                texel = coarse->at(std::min(x / 2, coarse->width - 1), std::min(y / 2, coarse->height - 1));
                texel.w = 0;
            }
        }
    }
}

std::vector<Rgba> drawn(int size, const std::function<Rgba(float u, float v)>& image) {
    std::vector<Rgba> texels(static_cast<size_t>(size) * size);
    tbb::parallel_for(0, size, [&](int y) {
        for (int x = 0; x < size; ++x) {
            texels[static_cast<size_t>(y) * size + x] = image((x + 0.5f) / size, (y + 0.5f) / size);
        }
    });
    return texels;
}

}  // namespace

Texture::Texture(int log2_size, const std::function<Rgba(float u, float v)>& image)
    : Texture(log2_size, log2_size, drawn(1 << log2_size, image)) {}

Texture::Texture(int log2_width, int log2_height, std::vector<Rgba> texels)
    : log2_width_(log2_width),
      log2_height_(log2_height),
      opaque_(std::ranges::all_of(texels, [](const Rgba& c) { return c.a >= 1; })) {
    std::vector<Level> levels{{1 << log2_width, 1 << log2_height, {}}};
    for (const auto [r, g, b, a] : texels) levels[0].texels.push_back({r * a, g * a, b * a, a});
    while (levels.back().texels.size() > 1) levels.push_back(halved(levels.back()));
    for (const Level* coarse = nullptr; Level & level : levels | std::views::reverse) {
        unassociate(level, coarse);
        coarse = &level;
    }
    for (const Level& level : levels) {
        level_starts_.push_back(texels_.size());
        for (const V4f& c : level.texels) {
            texels_.push_back({quantise(c.x), quantise(c.y), quantise(c.z), quantise(c.w)});
        }
    }
}

std::shared_ptr<const Texture> Texture::load(const std::filesystem::path& path) {
    const io::Pixels image = io::read_image(path, 4);
    const bool grey = image.channels < 3, has_alpha = image.channels % 2 == 0;
    OIIO::ImageBuf buffer(OIIO::ImageSpec(image.size.width, image.size.height, 4, OIIO::TypeDesc::FLOAT));
    for (int y = 0; y < image.size.height; ++y) {
        for (int x = 0; x < image.size.width; ++x) {
            const float alpha = has_alpha ? image.at(x, y, image.channels - 1) : 1;
            const auto color = [&](int channel) { return decode_srgb(image.at(x, y, grey ? 0 : channel)) * alpha; };
            const float texel[4] = {color(0), color(1), color(2), alpha};
            buffer.setpixel(x, y, texel);
        }
    }
    const auto width = std::bit_ceil(static_cast<unsigned>(image.size.width));
    const auto height = std::bit_ceil(static_cast<unsigned>(image.size.height));
    const OIIO::ROI all(0, static_cast<int>(width), 0, static_cast<int>(height), 0, 1, 0, 4);
    if (buffer.roi() != all) buffer = OIIO::ImageBufAlgo::resize(buffer, "triangle", 0, all);
    std::vector<Rgba> texels(static_cast<size_t>(width) * height);
    if (buffer.has_error() || !buffer.get_pixels(all, OIIO::TypeDesc::FLOAT, texels.data()))
        fail(ErrorKind::file, "cannot resize the texture {}: {}", path.string(), buffer.geterror());
    for (auto& [r, g, b, a] : texels) {
        if (a > 0) r /= a, g /= a, b /= a;
    }
    return std::make_shared<Texture>(std::countr_zero(width), std::countr_zero(height), std::move(texels));
}

Texture::Taps Texture::taps(V2f uv, int level) const {
    const int log2_width = std::max(0, log2_width_ - level), log2_height = std::max(0, log2_height_ - level);
    const int columns = (1 << log2_width) - 1, rows = (1 << log2_height) - 1;  // masks
    const float x = uv.x * static_cast<float>(columns + 1) - 0.5f, y = uv.y * static_cast<float>(rows + 1) - 0.5f;
    const int left = floor_to_int(x), top = floor_to_int(y);
    const Texel* upper = &texels_[level_starts_[level] + (static_cast<size_t>(top & rows) << log2_width)];
    const Texel* lower = &texels_[level_starts_[level] + (static_cast<size_t>((top + 1) & rows) << log2_width)];
    return {upper + (left & columns),       upper + ((left + 1) & columns), lower + (left & columns),
            lower + ((left + 1) & columns), x - static_cast<float>(left),   y - static_cast<float>(top)};
}

V4f Texture::bilinear(V2f uv, int level) const {
    const Taps t = taps(uv, level);
    const float w11 = t.fx * t.fy, w01 = t.fy - w11, w10 = t.fx - w11, w00 = 1 - t.fx - w01;
    V4f sum;
    for (int c = 0; c < 4; ++c) {
        const auto linear = [c](const Texel* texel) { return static_cast<float>((*texel)[c] * (*texel)[c]); };
        sum[c] = w00 * linear(t.t00) + w10 * linear(t.t10) + w01 * linear(t.t01) + w11 * linear(t.t11);
    }
    return sum * (1 / (255.0f * 255.0f));
}

V4f Texture::sample(V2f uv, float level) const {
    const int coarsest = std::max(log2_width_, log2_height_);
    if (level <= 0) return bilinear(uv, 0);
    if (level >= static_cast<float>(coarsest)) return bilinear(uv, coarsest);
    const int fine = static_cast<int>(level);
    const float blend = level - static_cast<float>(fine);
    return bilinear(uv, fine) * (1 - blend) + bilinear(uv, fine + 1) * blend;
}

float Texture::alpha(V2f uv) const {
    const Taps t = taps(uv, 0);
    const auto linear = [](const Texel* texel) { return static_cast<float>((*texel)[3] * (*texel)[3]); };
    const float upper = linear(t.t00) + (linear(t.t10) - linear(t.t00)) * t.fx;
    const float lower = linear(t.t01) + (linear(t.t11) - linear(t.t01)) * t.fx;
    return (upper + (lower - upper) * t.fy) / (255.0f * 255.0f);
}

}  // namespace clarus::render
