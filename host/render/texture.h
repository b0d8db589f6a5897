#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <vector>

namespace clarus::render {

struct Rgba {
    float r = 0, g = 0, b = 0, a = 1;
};

/// An image that repeats, with its mip pyramid; v runs down from the first row. Colours are linear, in [0, 1], not
/// multiplied by alpha. OpenImageIO reads the files; its texture system is not used for lookups, because with it the
/// demo scene comes to 1.2 million primary rays a second on a core, with this pyramid to 2.3 million.
class Texture {
  public:
    /// Texel centres of a grid of 2^log2_size by 2^log2_size over [0, 1)² are taken from `image`.
    Texture(int log2_size, const std::function<Rgba(float u, float v)>& image);
    /// Rows of 2^log2_width texels, 2^log2_height of them.
    Texture(int log2_width, int log2_height, std::vector<Rgba> texels);
    /// Any image that OpenImageIO reads (1 to 4 channels: grey, grey and alpha, RGB, RGB and alpha), taken as
    /// display-encoded; resized to the powers of two that are not below its size. Errors: file, naming it.
    static std::shared_ptr<const Texture> load(const std::filesystem::path& path);

    /// Of the full image.
    Imath::V2f size() const { return Imath::V2f(1 << log2_width_, 1 << log2_height_); }
    /// Whether alpha is 1 everywhere.
    bool opaque() const { return opaque_; }
    /// Red, green, blue, alpha; trilinear. `level` 0 is the full image; values outside the pyramid are clamped to it.
    Imath::V4f sample(Imath::V2f uv, float level) const;
    /// The full image's alpha, bilinear.
    float alpha(Imath::V2f uv) const;

  private:
    // Square roots of the linear values, since 8 bits of them serve dark colours too.
    using Texel = std::array<uint8_t, 4>;
    struct Taps {
        const Texel *t00, *t10, *t01, *t11;
        float fx, fy;
    };
    Taps taps(Imath::V2f uv, int level) const;
    Imath::V4f bilinear(Imath::V2f uv, int level) const;

    int log2_width_, log2_height_;
    bool opaque_;
    std::vector<size_t> level_starts_;
    std::vector<Texel> texels_;
};

}  // namespace clarus::render
