#include <doctest/doctest.h>

#include "operator_harness.h"

using namespace clarus;
using namespace clarus::test;
using runtime::Storage;

namespace {

struct Part {
    int block = 1, stride, offset;
};

runtime::TensorLayout layout(graph::Shape shape, Storage storage, Part part) {
    return part_layout(shape, storage, part.block, part.stride, part.offset);
}

void check_samples(graph::Shape render, int scale, Storage storage, Part large, Part small) {
    CAPTURE(scale);
    std::mt19937 random(3);
    const graph::Shape output{render.channels, render.height * scale, render.width * scale};
    const Planes image = rounded(random_planes(output, random), storage);
    const Planes samples = rounded(random_planes(render, random), storage);
    for (int position = 0; position < scale * scale; ++position) {
        runtime::FrameConstants frame;
        frame.sample_x = position % scale;
        frame.sample_y = position / scale;

        runtime::Problem pick;
        pick.node = {graph::Pick{scale}, {}, render, "pick"};
        pick.inputs = {layout(output, storage, large)};
        pick.output = layout(render, storage, small);
        check_operator(
            pick, {image}, frame,
            planes(render, [&](int c, int x,
                               int y) { return image.at(c, scale * x + frame.sample_x, scale * y + frame.sample_y); }),
            0);

        runtime::Problem place;
        place.node = {graph::Place{scale}, {}, output, "place"};
        place.inputs = {layout(output, storage, large), layout(render, storage, small)};
        place.output = place.inputs[0];
        check_operator(place, {image, samples}, frame,
                       planes(output,
                              [&](int c, int x, int y) {
                                  const bool placed = x % scale == frame.sample_x && y % scale == frame.sample_y;
                                  return placed ? samples.at(c, x / scale, y / scale) : image.at(c, x, y);
                              }),
                       0);
    }
}

}  // namespace

TEST_CASE("samples are picked from and placed in a larger image") {
    check_samples({3, 7, 11}, 2, Storage::f32, {1, 4, 0}, {1, 4, 0});
    check_samples({4, 9, 5}, 3, Storage::f16, {1, 5, 1}, {1, 6, 2});
    check_samples({5, 4, 6}, 2, Storage::f32, {2, 24, 3}, {1, 5, 0});
}

TEST_SUITE("small") {
    TEST_CASE("samples of the smallest image") { check_samples({3, 1, 1}, 3, Storage::f32, {1, 4, 0}, {1, 4, 0}); }
}
