#include "render/worlds/hud.h"

#include <OpenImageIO/imagebufalgo.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "render/worlds/lettering.h"

namespace clarus::render {
namespace {

using Color = std::array<float, 4>;  // display-encoded, multiplied with alpha
constexpr int width = 1920, height = 1080;

class Screen {
  public:
    explicit Screen(Random& random)
        : random_(random), image_(OIIO::ImageSpec(width, height, 4, OIIO::TypeDesc::FLOAT)) {
        OIIO::ImageBufAlgo::zero(image_);
        const auto channel = [&] { return static_cast<float>(random.uniform(0.3, 1)); };
        accent_ = {channel(), channel(), channel(), 1};
        opacity_ = static_cast<float>(random.uniform(0.45, 1));
    }

    /// Some of everything, at least one thing.
    OIIO::ImageBuf draw() {
        bars();
        if (random_.below(3)) crosshair();
        if (random_.below(2)) map();
        if (random_.below(2)) messages();
        if (random_.below(2)) slots();
        if (random_.below(3) == 0) numbers();
        return std::move(image_);
    }

  private:
    Color shade(float light) const {
        return {accent_[0] * light * opacity_, accent_[1] * light * opacity_, accent_[2] * light * opacity_, opacity_};
    }
    Color dark() const { return {0.02f, 0.02f, 0.03f, 0.55f * opacity_}; }

    void box(int x, int y, int w, int h, const Color& color) {
        const OIIO::ROI roi(std::max(0, x), std::min(width, x + w), std::max(0, y), std::min(height, y + h));
        if (roi.npixels() > 0 && x < width && y < height) OIIO::ImageBufAlgo::fill(image_, color, roi);
    }

    /// Everything within a ring.
    void ring(int cx, int cy, float inner, float outer, const Color& color) {
        const int reach = static_cast<int>(outer) + 1;
        for (int y = cy - reach; y <= cy + reach; ++y) {
            for (int x = cx - reach; x <= cx + reach; ++x) {
                const float distance = std::hypot(static_cast<float>(x - cx), static_cast<float>(y - cy));
                if (distance >= inner && distance <= outer) image_.setpixel(x, y, color);
            }
        }
    }

    void write(int x, int y, int size, int words) {
        write_text(image_, x, y, size, invented_words(random_, words), shade(1));
    }

    void bars() {
        const bool below = random_.below(2);
        for (int bar = 1 + random_.below(3); bar > 0; --bar) {
            const int y = below ? height - 60 * bar : 60 * bar - 25, length = 250 + random_.below(250);
            box(40, y, length, 22, dark());
            box(43, y + 3, (length - 6) * (20 + random_.below(80)) / 100, 16, shade(bar % 2 ? 1.0f : 0.6f));
            if (random_.below(2)) write(50 + length, y + 20, 24, 1);
        }
    }

    void crosshair() {
        const int cx = width / 2, cy = height / 2, gap = 4 + random_.below(10), arm = 8 + random_.below(16),
                  thick = 2 + random_.below(3);
        for (const int side : {-1, 1}) {
            box(side < 0 ? cx - gap - arm : cx + gap, cy - thick / 2, arm, thick, shade(1));
            box(cx - thick / 2, side < 0 ? cy - gap - arm : cy + gap, thick, arm, shade(1));
        }
        if (random_.below(2)) ring(cx, cy, 30, 32.5f, shade(0.9f));
    }

    void map() {
        const int size = 90 + random_.below(60), cx = width - size - 40,
                  cy = random_.below(2) ? size + 40 : height - size - 40;
        const auto radius = static_cast<float>(size);
        ring(cx, cy, 0, radius, dark());
        ring(cx, cy, radius - 4, radius, shade(0.8f));
        for (int i = 0; i < 12; ++i) {
            const double turn = random_.uniform(0, 6.28), far = random_.uniform(0, 0.85 * size);
            ring(cx + static_cast<int>(far * std::cos(turn)), cy + static_cast<int>(far * std::sin(turn)), 0, 4,
                 shade(i % 3 ? 1.0f : 0.5f));
        }
    }

    void messages() {
        const int size = 18 + random_.below(14), x = random_.below(2) ? 40 : width - 620,
                  top = 200 + random_.below(300);
        const int lines = 2 + random_.below(5);
        if (random_.below(2)) box(x - 14, top - size - 8, 600, lines * size * 3 / 2 + 16, dark());
        for (int line = 0; line < lines; ++line) write(x, top + line * size * 3 / 2, size, 2 + random_.below(4));
    }

    void slots() {
        const int count = 3 + random_.below(7), side = 64, left = width / 2 - count * (side + 10) / 2;
        for (int slot = 0; slot < count; ++slot) {
            const int x = left + slot * (side + 10), y = height - side - 30;
            box(x, y, side, side, shade(slot == 1 ? 1.0f : 0.4f));
            box(x + 3, y + 3, side - 6, side - 6, dark());
            ring(x + side / 2, y + side / 2, static_cast<float>(random_.below(10)), 20, shade(0.9f));
        }
    }

    void numbers() {
        write_text(image_, width - 330, height - 60, 90, std::to_string(random_.below(400)), shade(1));
        write_text(image_, width - 120, height - 60, 32, "km/h", shade(0.8f));
    }

    Random& random_;
    OIIO::ImageBuf image_;
    Color accent_{};
    float opacity_ = 1;
};

}  // namespace

Overlay invented_hud(Random& random) {
    const OIIO::ImageBuf image = Screen(random).draw();
    const auto texels = std::make_shared<std::vector<Rgba>>(static_cast<size_t>(width) * height);
    image.get_pixels(OIIO::ROI::All(), OIIO::TypeDesc::FLOAT, texels->data());
    return [texels](Imath::V2f place) {
        // Bilinear; what is drawn is multiplied with alpha until here.
        const float x = std::clamp(place.x * width - 0.5f, 0.0f, width - 1.001f);
        const float y = std::clamp(place.y * height - 0.5f, 0.0f, height - 1.001f);
        const auto left = static_cast<size_t>(x), top = static_cast<size_t>(y);
        const float fx = x - static_cast<float>(left), fy = y - static_cast<float>(top);
        const Rgba* upper = &(*texels)[top * width + left];
        const Rgba* lower = upper + width;
        const auto mean = [&](float Rgba::*c) {
            return std::lerp(std::lerp(upper[0].*c, upper[1].*c, fx), std::lerp(lower[0].*c, lower[1].*c, fx), fy);
        };
        const float alpha = mean(&Rgba::a);
        if (alpha <= 0) return Rgba{0, 0, 0, 0};
        return Rgba{mean(&Rgba::r) / alpha, mean(&Rgba::g) / alpha, mean(&Rgba::b) / alpha, alpha};
    };
}

}  // namespace clarus::render
