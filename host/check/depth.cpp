#include "check/depth.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "check/parallel.h"
#include "io/decode.h"

namespace clarus::check {
namespace {

constexpr float none = std::numeric_limits<float>::quiet_NaN();
constexpr float step = 0.1f;            // in rank: from one thing to another
constexpr size_t fewest_pixels = 48;    // that a figure is made of
constexpr float most_curvature = 0.1f;  // of planes; noise has 0.25

float median(std::vector<float>& values) {
    if (values.size() < fewest_pixels) return none;
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

struct Warp {
    const Film& film;
    const Reading& reading;
    Vec2 shift;
    const io::Pixels* motion;
    Size size;

    Vec2 source(int x, int y) const {
        Vec2 move;
        if (motion) move = reading.displacement({motion->at(x, y, 0), motion->at(x, y, 1)}, size, film.sequence.scale);
        return {static_cast<float>(x) + move.x + shift.x, static_cast<float>(y) + move.y + shift.y};
    }
};

/// Hidden by larger depths, and by smaller ones. All four pixels around the place must say so, of all nine around the
/// pixel: at an edge's border rounding says either, and a thin thing is found between pixels one frame and lost the
/// next.
std::array<float, 2> count_hidden(const Plane& before, const Plane& now, const Warp& warp) {
    std::array<float, 2> count{};
    for (int y = 1; y + 1 < now.size.height; ++y)
        for (int x = 1; x + 1 < now.size.width; ++x) {
            const Vec2 from = warp.source(x, y);
            if (!(from.x >= 0 && from.y >= 0 && from.x < static_cast<float>(now.size.width - 1) &&
                  from.y < static_cast<float>(now.size.height - 1)))
                continue;
            const int i = static_cast<int>(from.x), j = static_cast<int>(from.y);
            const auto [least, most] =
                std::minmax({before.at(i, j), before.at(i + 1, j), before.at(i, j + 1), before.at(i + 1, j + 1)});
            if (!(least > now.at(x, y) + step) && !(most < now.at(x, y) - step)) continue;
            float low = now.at(x, y), high = low;
            for (int v = y - 1; v <= y + 1; ++v)
                for (int u = x - 1; u <= x + 1; ++u) {
                    low = std::min(low, now.at(u, v));
                    high = std::max(high, now.at(u, v));
                }
            if (least > high + step) ++count[0];
            if (most < low - step) ++count[1];
        }
    return count;
}

std::array<float, 3> curvatures(const io::Pixels& depth) {
    constexpr int reach = 3;  // pixels: near ones differ by little more than rounding
    std::array<std::vector<float>, 3> all;
    const auto look = [&](float a, float b, float c) {
        for (const float value : {a, b, c})
            if (!(value > 0 && value < 1)) return;
        const float first = c - a, second = c - 2 * b + a;
        // A step, or nothing that is steeper than rounding.
        if (std::abs(second) > 0.5f * std::abs(first) || std::abs(first) < 1e-5f) return;
        const auto ratio = [](double p, double q, double r) {
            return static_cast<float>(std::abs(p - 2 * q + r) / std::abs(r - p));
        };
        all[0].push_back(ratio(1.0 / a, 1.0 / b, 1.0 / c));
        all[1].push_back(ratio(1 / (1.0 - a), 1 / (1.0 - b), 1 / (1.0 - c)));
        all[2].push_back(ratio(a, b, c));
    };
    for (int y = reach; y + reach < depth.size.height; ++y)
        for (int x = reach; x + reach < depth.size.width; ++x) {
            look(depth.at(x - reach, y, 0), depth.at(x, y, 0), depth.at(x + reach, y, 0));
            look(depth.at(x, y - reach, 0), depth.at(x, y, 0), depth.at(x, y + reach, 0));
        }
    std::array<float, 3> result{};
    for (size_t form = 0; form < result.size(); ++form) result[form] = median(all[form]) + 1e-5f;
    // No form makes planes of it: what was left out above, by stored values, would favour those.
    if (!(std::ranges::min(result) < most_curvature)) result.fill(none);
    return result;
}

using Camera = FrameDescription::Camera;

/// The place in the image before of what is at (x, y) in this one, at view distance z; both pixel positions.
Vec2 reproject(const Camera& now, const Camera& before, Size size, double x, double y, double z) {
    const double toward = now.projection[14] < 0 ? -1 : 1;  // the sign of view space's z
    const double ndc_x = 2 * x / size.width - 1, ndc_y = 1 - 2 * y / size.height;
    const double depth = toward * z;
    const std::array<double, 3> view{(ndc_x * z - now.projection[2] * depth) / now.projection[0] - now.view[3],
                                     (ndc_y * z - now.projection[6] * depth) / now.projection[5] - now.view[7],
                                     depth - now.view[11]};
    std::array<double, 3> world{}, old{};
    for (size_t i = 0; i < 3; ++i)
        for (size_t k = 0; k < 3; ++k) world[i] += now.view[4 * k + i] * view[k];  // a rotation: its transpose
    for (size_t i = 0; i < 3; ++i) {
        old[i] = before.view[4 * i + 3];
        for (size_t k = 0; k < 3; ++k) old[i] += before.view[4 * i + k] * world[k];
    }
    const double w = toward * old[2];
    const double clip_x = before.projection[0] * old[0] + before.projection[2] * old[2];
    const double clip_y = before.projection[5] * old[1] + before.projection[6] * old[2];
    return {static_cast<float>((clip_x / w + 1) / 2 * size.width),
            static_cast<float>((1 - clip_y / w) / 2 * size.height)};
}

/// View distance of canonical depth 1 (docs/conventions.md, "Depth").
double unit_of(const io::FrameFiles& planes) {
    return std::isfinite(planes.far_plane) ? planes.far_plane : 1e4 * planes.near_plane;
}

/// As DepthEvidence::reprojected. Rays of all pixels would be many: every third along each axis.
std::array<float, 6> reprojection(const Film& film, Pair pair, const Warp& warp, const io::Pixels& depth) {
    std::array<float, 6> result;
    result.fill(none);
    const io::FrameFiles& frame = film.sequence.frames[pair.frame];
    const auto& before = film.sequence.frames[pair.before].camera;
    const auto& now = frame.camera;
    if (!before || !now || !warp.motion) return result;
    io::FrameFiles cameras = frame;
    cameras.near_plane = now->near_plane;
    cameras.far_plane = now->far_plane;
    for (size_t answer = 0; answer < result.size(); ++answer) {
        const bool projective = answer >= 2;
        if (projective && answer < 4 && !film.sequence.depth.projective) continue;
        const io::FrameFiles& planes = projective && answer < 4 ? frame : cameras;
        io::Sequence how;
        how.depth = {.projective = projective, .reversed = answer % 2 == 1};
        const io::Pixels canonical = io::decode_depth(depth, how, planes);
        std::vector<float> distances;
        for (int y = 1; y < warp.size.height; y += 3)
            for (int x = 1; x < warp.size.width; x += 3) {
                const double z = unit_of(planes) * canonical.at(x, y, 0);
                if (!(canonical.at(x, y, 0) < 1) || z <= 0) continue;
                const Vec2 to = reproject(*now, *before, warp.size, x + 0.5, y + 0.5, z);
                const Vec2 is = warp.source(x, y);
                const float distance = std::hypot(to.x - 0.5f - is.x + warp.shift.x, to.y - 0.5f - is.y + warp.shift.y);
                if (std::isfinite(distance)) distances.push_back(distance);
            }
        result[answer] = median(distances) + 0.01f;
    }
    return result;
}

/// The steepest pixels of depth ranks, one in twenty, where these are steps from one thing to another.
std::vector<char> edges_of(const std::vector<float>& steepness) {
    std::vector<float> sorted = steepness;
    const auto high = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() - 1 - sorted.size() / 20);
    std::nth_element(sorted.begin(), high, sorted.end());
    const float from = std::max(*high, step);
    std::vector<char> edges(steepness.size());
    std::ranges::transform(steepness, edges.begin(), [&](float value) { return value >= from; });
    return edges;
}

/// |difference| across a pixel; borders have none.
std::vector<float> steepness_of(const Plane& plane) {
    const auto [width, height] = plane.size;
    std::vector<float> out(plane.values.size());
    for (int y = 1; y + 1 < height; ++y)
        for (int x = 1; x + 1 < width; ++x)
            out[static_cast<size_t>(y) * width + x] =
                std::hypot(plane.at(x + 1, y) - plane.at(x - 1, y), plane.at(x, y + 1) - plane.at(x, y - 1));
    return out;
}

/// 1 / (mean steepness of colour on the edges).
float distance_from(const std::vector<char>& edges, const std::vector<float>& color) {
    constexpr float steepest = 0.3f;
    double sum = 0;
    size_t count = 0;
    for (size_t i = 0; i < edges.size(); ++i)
        if (edges[i]) sum += std::min(color[i], steepest), ++count;
    return count < fewest_pixels || sum == 0 ? none : static_cast<float>(static_cast<double>(count) / sum);
}

Answers<3> compare_edges(const Film& film, const std::vector<std::vector<char>>& edges) {
    const size_t count = film.luma.size();
    Answers<3> result;
    for (auto& answer : result) answer.assign(count, none);
    for_each_index(count, [&](size_t i) {
        const std::vector<float> color = steepness_of(film.luma[i]);
        const auto look = [&](size_t answer, size_t frame, bool follows) {
            if (follows && edges[frame].size() == color.size()) result[answer][i] = distance_from(edges[frame], color);
        };
        look(0, i, true);
        if (i > 0) look(1, i - 1, !film.sequence.frames[i].reset);
        if (i + 1 < count) look(2, i + 1, !film.sequence.frames[i + 1].reset);
    });
    return result;
}

}  // namespace

DepthEvidence measure_depth(const Film& film, const std::vector<Pair>& pairs, const Reading& reading, int depth_frame) {
    DepthEvidence evidence;
    if (!film.has_depth()) return evidence;
    const auto depth_of = [&](size_t frame) {
        return film.depth[static_cast<size_t>(
            std::clamp<long>(static_cast<long>(frame) + depth_frame, 0, static_cast<long>(film.depth.size()) - 1))];
    };
    for (auto& answer : evidence.curvature) answer.resize(film.depth.size());
    for_each_index(film.depth.size(), [&](size_t i) {
        const std::array<float, 3> values = curvatures(film.depth[i]);
        for (size_t form = 0; form < 3; ++form) evidence.curvature[form][i] = values[form];
    });
    const auto prepare = [&](auto& answers) {
        for (auto& answer : answers) answer.assign(pairs.size(), none);
    };
    prepare(evidence.hidden_by);
    prepare(evidence.reprojected);
    std::vector<io::Pixels> stored;
    for (size_t i = 0; i < film.depth.size(); ++i) stored.push_back(depth_of(i));
    const std::vector<Plane> ranks = depth_ranks(stored);
    for_each_index(pairs.size(), [&](size_t i) {
        const auto [before, frame] = pairs[i];
        const std::optional<Vec2> change = film.jitter_change(before, frame, reading.jitter_frame);
        const io::Pixels* motion = film.motion_of(frame, reading);
        if (!change || (film.has_motion() && !motion) || ranks[before].size != ranks[frame].size) return;
        const Warp warp{film, reading, reading.shift(*change), motion, ranks[frame].size};
        const auto hidden = count_hidden(ranks[before], ranks[frame], warp);
        for (size_t k = 0; k < 2; ++k) evidence.hidden_by[k][i] = hidden[k];
        const auto distances = reprojection(film, pairs[i], warp, stored[frame]);
        for (size_t k = 0; k < distances.size(); ++k) evidence.reprojected[k][i] = distances[k];
    });
    return evidence;
}

Answers<3> measure_depth_edges(const Film& film) {
    if (!film.has_depth()) return {};
    const std::vector<Plane> ranks = depth_ranks(film.depth);
    std::vector<std::vector<char>> edges(ranks.size());
    for_each_index(edges.size(), [&](size_t i) { edges[i] = edges_of(steepness_of(ranks[i])); });
    return compare_edges(film, edges);
}

}  // namespace clarus::check
