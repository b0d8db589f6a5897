#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "api/build_graph.h"
#include "api/effects.h"
#include "clarus/error.h"
#include "fit_reference.h"
#include "golden.h"
#include "one_frame.h"
#include "test_device.h"

using namespace clarus;
using namespace clarus::test;

namespace {

Planes planes_of(const std::vector<float>& pixels, Size size) {
    return planes({3, size.height, size.width},
                  [&](int c, int x, int y) { return pixels[(static_cast<size_t>(y) * size.width + x) * 3 + c]; });
}

std::vector<std::string> nodes(Size shown, const UpscalerOptions& options) {
    const Model model = Model::filter("bicubic", 2);
    const Size render{8, 6}, own = output_size(render, model.scale());
    const graph::Graph graph = with_effects(build_graph(model, render, own, options.pipeline_options), shown, options);
    std::vector<std::string> names;
    for (const graph::Node& node : graph.nodes) names.push_back(node.name);
    return names;
}

}  // namespace

TEST_CASE("an output size changes what is shown and not the history" * doctest::test_suite("golden")) {
    for (const char* name : {"enss_x2_table", "mnss_x2", "nss_x2", "srpo_x2"}) {
        CAPTURE(std::string(name));
        const Golden golden(name);
        const Size own = output_size(golden.render, golden.model.scale());
        const std::vector<std::vector<float>> plain = run(golden, {}, 3).outputs;
        for (const Size size : {Size{own.width * 3 / 2, own.height + 5},
                                {own.width * 2 / 3, own.height / 2},
                                {own.width + 7, own.height * 3 / 4}}) {
            UpscalerOptions options;
            options.output_size = size;
            const Run resized = run(golden, options, 3);
            CHECK(resized.upscaler.output_size() == size);
            for (size_t t = 0; t < plain.size(); ++t)
                check_close(planes_of(resized.outputs[t], size), expected_fit(planes_of(plain[t], own), size), 1e-5f);
        }
        UpscalerOptions same;
        same.output_size = own;
        CHECK(run(golden, same, 3).outputs == plain);
    }
}

TEST_CASE("every model and filter serves an output size" * doctest::test_suite("small")) {
    for (const std::string& name : Model::names()) {
        CAPTURE(name);
        UpscalerOptions options;
        options.output_size = Size{61, 47};
        CHECK(Upscaler(test_device(), Model::find(name), {24, 16}, options).output_size() == Size{61, 47});
    }
}

TEST_CASE("the model's own size adds no pass, another goes between antialiasing and sharpening" *
          doctest::test_suite("small")) {
    UpscalerOptions options;
    const std::vector<std::string> plain{"color", "resample"};
    CHECK(nodes({16, 12}, options) == plain);
    options.antialias = Antialiasing::mlaa;
    options.sharpen = 0.2f;
    CHECK(nodes({17, 12}, options) ==
          std::vector<std::string>{"color", "resample", "mlaa", "output size", "enhancement: sharpening"});
}

TEST_CASE("linear light keeps its flats at another size" * doctest::test_suite("small")) {
    UpscalerOptions options;
    options.color_space = ColorSpace::linear;
    const auto shown = [&](std::optional<Size> size) {
        options.output_size = size;
        Upscaler upscaler(test_device(), Model::filter("bilinear", 2), {6, 5}, options);
        return upscaled(upscaler, std::vector<float>(6 * 5 * 3, 7.5f));
    };
    const std::vector<float> flat = shown(std::nullopt);
    for (const Size size : {Size{17, 9}, {7, 21}})
        for (const float value : shown(size)) CHECK(value == flat.front());
}

TEST_CASE("an output size beyond its range is refused" * doctest::test_suite("small")) {
    for (const Size size : {Size{0, 8}, {8, -1}, {33, 8}, {8, 33}, {1, 8}, {8, 1}}) {
        UpscalerOptions options;
        options.output_size = size;
        CHECK_THROWS_WITH_AS(Upscaler(test_device(), Model::filter("bicubic", 2), {4, 4}, options),
                             doctest::Contains("the model makes 8x8"), Error);
    }
    UpscalerOptions options;
    options.output_size = Size{40000, 8};
    CHECK_THROWS_WITH_AS(Upscaler(test_device(), Model::filter("bicubic", 2), {10000, 4}, options),
                         doctest::Contains("to 32768"), Error);
}
