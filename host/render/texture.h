#pragma once

#include <Imath/ImathVec.h>

#include <cstdint>
#include <functional>
#include <vector>

namespace clarus::render {

struct Rgba {
    float r = 0, g = 0, b = 0, a = 1;
};

/// A square image that repeats, with its mip pyramid. Colours are linear, in [0, 1].
class Texture {
  public:
    /// Texel centres of a grid of 2^log2_size by 2^log2_size over [0, 1)² are taken from `image`.
    Texture(int log2_size, const std::function<Rgba(float u, float v)>& image);

    int size() const { return 1 << log2_size_; }
    /// Trilinear. `level` 0 is the full image; values outside the pyramid are clamped to it.
    Imath::V3f sample(Imath::V2f uv, float level) const;
    /// The full image's alpha, bilinear.
    float alpha(Imath::V2f uv) const;

  private:
    // Square roots of the linear values, since 8 bits of them serve dark colours too; alpha as it is.
    struct Texel {
        uint8_t r, g, b, a;
    };
    struct Taps {
        const Texel *t00, *t10, *t01, *t11;
        float fx, fy;
    };
    Taps taps(Imath::V2f uv, int level) const;
    Imath::V3f bilinear(Imath::V2f uv, int level) const;

    int log2_size_;
    std::vector<size_t> level_starts_;
    std::vector<Texel> texels_;
};

}  // namespace clarus::render
