#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "operator_harness.h"

using namespace clarus;
using namespace clarus::test;
using runtime::Storage;

namespace {

/// Offsets of all kinds: small, halfway between two pixels, and to far outside.
Planes any_offsets(Size size, std::mt19937& random) {
    std::uniform_real_distribution<float> small(-0.6f, 0.6f), large(-40, 40);
    std::uniform_int_distribution<int> kind(0, 7), whole(-3, 3);
    return planes({2, size.height, size.width}, [&](int, int, int) {
        const int chosen = kind(random);
        return chosen == 0 ? large(random) : chosen == 1 ? static_cast<float>(whole(random)) - 0.5f : small(random);
    });
}

int rounded_offset(float offset) { return static_cast<int>(std::floor(offset + 0.5)); }

Planes expected_mask(const Planes& offsets) {
    const int width = offsets.shape.width, height = offsets.shape.height;
    double sum = 0;
    for (int d = -3; d <= 3; ++d) sum += std::exp(-0.5 * d * d);
    return planes({1, height, width}, [&](int, int x, int y) {
        double mask = 0;
        for (int dy = -3; dy <= 3; ++dy) {
            for (int dx = -3; dx <= 3; ++dx) {
                const int i = x + dx, j = y + dy;
                if (i < 0 || j < 0 || i >= width || j >= height) continue;
                const bool moved = rounded_offset(offsets.at(0, i, j)) != 0 || rounded_offset(offsets.at(1, i, j)) != 0;
                if (moved) mask += std::exp(-0.5 * (dx * dx + dy * dy)) / (sum * sum);
            }
        }
        return static_cast<float>(std::clamp(mask, 0.0, 1.0));
    });
}

void check_offsets(Size render, int scale, Storage storage) {
    CAPTURE(scale);
    std::mt19937 random(4);
    const Size size{render.width * scale, render.height * scale};
    const graph::Shape in{3, render.height, render.width}, out{3, size.height, size.width};
    const Planes offsets = rounded(any_offsets(size, random), storage);
    const Planes color = rounded(random_planes(in, random), storage);
    const Planes mask = rounded(random_planes({1, size.height, size.width}, random), storage);
    const Planes between = rounded(random_planes(out, random), storage);
    // As the network's depth-to-space leaves them.
    const runtime::TensorLayout raw = part_layout(offsets.shape, storage, scale, 2 * scale * scale, 0);

    runtime::Problem blur;
    blur.node = {graph::OffsetMask{}, {}, mask.shape, "mask"};
    blur.inputs = {raw};
    blur.output = part_layout(mask.shape, storage, 1, 4, 1);
    check_operator(blur, {offsets}, {}, expected_mask(offsets), storage_tolerance(storage));

    runtime::Problem project;
    project.node = {graph::Project{scale}, {}, out, "project"};
    project.inputs = {part_layout(in, storage, 1, 4, 0), raw, part_layout(mask.shape, storage, 1, 4, 1),
                      part_layout(out, storage, 1, 4, 0)};
    project.output = pixel_layout(out, storage);
    const auto from = [&](int pixel, float offset, int extent) {
        return std::clamp(pixel / scale + rounded_offset(offset), 0, extent - 1);
    };
    const Planes expected = planes(out, [&](int c, int x, int y) {
        const int column = from(x, offsets.at(0, x, y), render.width);
        const int row = from(y, offsets.at(1, x, y), render.height);
        const float share = mask.at(0, x, y);
        return share * color.at(c, column, row) + (1 - share) * between.at(c, x, y);
    });
    check_operator(project, {color, offsets, mask, between}, {}, expected, storage_tolerance(storage));
}

}  // namespace

TEST_CASE("SRPO's mask is the blur of what is moved, its colours are moved by rounded offsets") {
    check_offsets({37, 21}, 2, Storage::f32);
    check_offsets({23, 17}, 3, Storage::f16);
    check_offsets({70, 5}, 1, Storage::f32);
}

TEST_CASE("SRPO's offsets that are no numbers lead to some pixel of the image") {
    const Size size{9, 7};
    const graph::Shape shape{3, size.height, size.width};
    const Planes color = planes(shape, [](int, int, int) { return 0.25f; });
    Planes offsets = planes({2, size.height, size.width}, [](int, int, int) { return 0.0f; });
    offsets.at(0, 3, 2) = std::numeric_limits<float>::quiet_NaN();
    offsets.at(1, 4, 5) = std::numeric_limits<float>::infinity();
    offsets.at(0, 8, 6) = -1e30f;
    const Planes mask = planes({1, size.height, size.width}, [](int, int, int) { return 1.0f; });
    runtime::Problem project;
    project.node = {graph::Project{1}, {}, shape, "project"};
    for (const graph::Shape& each : {shape, offsets.shape, mask.shape, shape})
        project.inputs.push_back(pixel_layout(each, Storage::f32));
    project.output = pixel_layout(shape, Storage::f32);
    check_operator(project, {color, offsets, mask, color}, {}, color, 0);
}

TEST_SUITE("small") {
    TEST_CASE("SRPO's offsets on small images") {
        check_offsets({1, 1}, 2, Storage::f32);
        check_offsets({3, 5}, 2, Storage::f32);
    }
}
