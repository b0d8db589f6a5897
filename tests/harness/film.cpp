#include "film.h"

#include <cmath>

#include "clarus/jitter.h"
#include "clarus/upscaler.h"
#include "test_device.h"

namespace clarus::test {

Color scene(double x, double y) {
    if (std::abs(y - 0.37 * x - 9) < 0.35) return {0.95, 0.9, 0.2};
    if (std::hypot(x - 40, y - 30) < 17) return {0.8, 0.25, 0.2};
    if (x < 30 && y > 34) return std::fmod(x + 0.3 * y, 3) < 1.5 ? Color{0.9, 0.9, 0.9} : Color{0.1, 0.15, 0.2};
    return {0.2 + 0.004 * x, 0.35, 0.6 - 0.003 * y};
}

std::vector<double> psnr_of(const Film& film, const std::string& filter, int frames, std::vector<float>* last_output) {
    Upscaler upscaler(test_device(), Model::filter(filter, film.scale), film.render);
    const Size size = upscaler.output_size();
    std::vector<float> color(static_cast<size_t>(3) * film.render.width * film.render.height),
        depth(color.size() / 3, 0.5f), motion(2 * depth.size()),
        output(static_cast<size_t>(3) * size.width * size.height);
    for (size_t i = 0; i < motion.size(); i += 2) {
        motion[i] = film.motion.x;
        motion[i + 1] = film.motion.y;
    }
    std::vector<double> result;
    for (int t = 0; t < frames; ++t) {
        const Vec2 jitter = halton_jitter(t, 32);
        for (int y = 0; y < film.render.height; ++y) {
            for (int x = 0; x < film.render.width; ++x) {
                const Color sample =
                    film.shows((x + 0.5 + jitter.x) * film.scale, (y + 0.5 + jitter.y) * film.scale, t);
                for (int c = 0; c < 3; ++c)
                    color[3 * (static_cast<size_t>(y) * film.render.width + x) + c] = static_cast<float>(sample[c]);
            }
        }
        FrameDescription frame;
        frame.color = {.host = color.data(), .size = film.render};
        frame.depth = {.host = depth.data(), .size = film.render};
        frame.motion = {.host = motion.data(), .size = film.render};
        frame.jitter = jitter;
        frame.output = {.host = output.data(), .size = size};
        upscaler.submit(frame).wait();

        constexpr int kSide = 8;  // samples of the reference along a pixel's side
        double error = 0;
        for (int y = 0; y < size.height; ++y) {
            for (int x = 0; x < size.width; ++x) {
                Color mean{};
                for (int i = 0; i < kSide * kSide; ++i) {
                    const Color sample = film.shows(x + (i % kSide + 0.5) / kSide, y + (i / kSide + 0.5) / kSide, t);
                    for (int c = 0; c < 3; ++c) mean[c] += sample[c] / (kSide * kSide);
                }
                for (int c = 0; c < 3; ++c)
                    error += std::pow(output[3 * (static_cast<size_t>(y) * size.width + x) + c] - mean[c], 2);
            }
        }
        result.push_back(10 * std::log10(static_cast<double>(output.size()) / error));
    }
    if (last_output) *last_output = output;
    return result;
}

}  // namespace clarus::test
