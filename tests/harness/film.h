#pragma once

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "clarus/types.h"

namespace clarus::test {

using Color = std::array<double, 3>;

/// A scene of discs, a grating finer than render pixels, and lines thinner than them. Coordinates in output pixels.
Color scene(double x, double y);

using Scene = std::function<Color(double, double, int)>;  // at a frame

struct Film {
    Size render{36, 28};
    double scale = 2;
    Vec2 motion{0, 0};  // of every vector, in render pixels
    Scene shows = [](double x, double y, int) { return scene(x, y); };
};

/// PSNR of every frame of a film, of a filter's output against each output pixel's mean.
std::vector<double> psnr_of(const Film& film, const std::string& filter, int frames,
                            std::vector<float>* last_output = nullptr);

}  // namespace clarus::test
