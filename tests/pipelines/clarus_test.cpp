#include <doctest/doctest.h>

#include <string>
#include <vector>

#include "golden.h"

using namespace clarus;
using namespace clarus::test;

namespace {

constexpr double kTolerance = 5e-5;  // eight recurrent frames in float against double; trust is steep

}  // namespace

TEST_CASE("Clarus agrees with the PyTorch network over eight frames and a reset" * doctest::test_suite("golden")) {
    for (const char* name : {"clarus_x2", "clarus_x3", "clarus_x4_1x1"}) {
        CAPTURE(name);
        const Run result = run(Golden(name));
        for (const double difference : result.differences) CHECK(difference < kTolerance);
    }
}

TEST_CASE("Clarus on the smallest image agrees with the PyTorch network" * doctest::test_suite("small")) {
    for (const double difference : run(Golden("clarus_x4_1x1")).differences) CHECK(difference < kTolerance);
}

TEST_CASE("Clarus shows what it saw inside" * doctest::test_suite("golden")) {
    const std::vector<std::string> all = {"trust", "collected", "details"};
    for (const std::vector<std::string>& views : {all, {"trust"}}) {
        UpscalerOptions options;
        options.views = views;
        const Golden golden("clarus_x3");
        const Run result = run(golden, options, kViewedFrame + 1);
        for (const std::string& name : views) {
            CAPTURE(name);
            CHECK(view_difference(result.upscaler, golden, name) < kTolerance);
        }
    }
}

TEST_CASE("Clarus computes the same with all its views kept, and in bands" * doctest::test_suite("golden")) {
    const Golden golden("clarus_x2");
    UpscalerOptions viewed, banded;
    viewed.views = run(golden, {}, 1).upscaler.view_names();
    banded.band_rows = 8;
    for (const UpscalerOptions& options : {viewed, banded})
        for (const double difference : run(golden, options).differences) CHECK(difference < kTolerance);
}

TEST_CASE("Clarus in half storage stays near" * doctest::test_suite("golden")) {
    UpscalerOptions options;
    options.precision = Precision::fp16;
    for (const double difference : run(Golden("clarus_x2"), options).differences) CHECK(difference < 0.02);
}
