#include "render/worlds/noise.h"

#include <algorithm>
#include <cmath>

#include "render/random.h"

namespace clarus::render {

using Imath::V2f;

float cell_value(int x, int y, int salt) {
    Random random((static_cast<uint64_t>(static_cast<uint32_t>(x)) << 32 | static_cast<uint32_t>(y)) * 64 +
                  static_cast<uint64_t>(salt));
    return static_cast<float>(random.uniform());
}

int wrap(int x, int period) { return (x % period + period) % period; }

float noise(float u, float v, int cells_u, int cells_v, int salt) {
    const float x = u * static_cast<float>(cells_u), y = v * static_cast<float>(cells_v);
    const int left = static_cast<int>(std::floor(x)), top = static_cast<int>(std::floor(y));
    const auto corner = [&](int dx, int dy) {
        return cell_value(wrap(left + dx, cells_u), wrap(top + dy, cells_v), salt);
    };
    const float fx = smooth(fraction(x)), fy = smooth(fraction(y));
    const float upper = std::lerp(corner(0, 0), corner(1, 0), fx), lower = std::lerp(corner(0, 1), corner(1, 1), fx);
    return std::lerp(upper, lower, fy);
}

float fractal(float u, float v, int cells, int octaves, int salt) {
    float sum = 0, weight = 0.5f, total = 0;
    for (int octave = 0; octave < octaves; ++octave, cells *= 2, weight /= 2) {
        sum += weight * noise(u, v, cells, cells, salt + octave);
        total += weight;
    }
    return sum / total;
}

Brick brick_at(float u, float v, int columns, int rows, bool shifted) {
    const float y = v * static_cast<float>(rows);
    const int row = static_cast<int>(std::floor(y));
    const float x = u * static_cast<float>(columns) + (shifted && row % 2 ? 0.5f : 0.0f);
    const int column = static_cast<int>(std::floor(x));
    const float fx = fraction(x), fy = fraction(y), aspect = static_cast<float>(rows) / static_cast<float>(columns);
    const float edge = std::min(std::min(fx, 1 - fx) * aspect, std::min(fy, 1 - fy));
    return {wrap(column, columns), wrap(row, rows), fx, fy, edge};
}

Cell cell_at(float u, float v, int cells, int salt) {
    const float x = u * static_cast<float>(cells), y = v * static_cast<float>(cells);
    const int left = static_cast<int>(std::floor(x)), top = static_cast<int>(std::floor(y));
    Cell cell{9, 9, 0};
    for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
            const int cx = wrap(left + dx, cells), cy = wrap(top + dy, cells);
            const V2f seed(static_cast<float>(left + dx) + 0.15f + 0.7f * cell_value(cx, cy, salt),
                           static_cast<float>(top + dy) + 0.15f + 0.7f * cell_value(cx, cy, salt + 1));
            const float distance = (seed - V2f(x, y)).length();
            if (distance < cell.nearest) {
                cell = {distance, cell.nearest, cell_value(cx, cy, salt + 2)};
            } else {
                cell.second = std::min(cell.second, distance);
            }
        }
    }
    return cell;
}

}  // namespace clarus::render
