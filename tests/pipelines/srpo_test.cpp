#include <doctest/doctest.h>

#include <string>

#include "golden.h"

using namespace clarus;
using namespace clarus::test;

namespace {

constexpr double kTolerance = 2e-6;

}  // namespace

TEST_CASE("SRPO agrees with the PyTorch network" * doctest::test_suite("golden")) {
    for (const char* name : {"srpo_x2", "srpo_x3", "srpo_x5_1x1", "srpo_x1", "srpo_x11"}) {
        CAPTURE(name);
        const Golden golden(name);
        const Run result = run(golden);
        CHECK_FALSE(result.upscaler.needs_motion());
        for (const double difference : result.differences) CHECK(difference < kTolerance);
    }
}

TEST_CASE("SRPO on the smallest image agrees with the PyTorch network" * doctest::test_suite("small")) {
    for (const double difference : run(Golden("srpo_x5_1x1"), {}, 2).differences) CHECK(difference < kTolerance);
}

TEST_CASE("SRPO shows its offsets and mask" * doctest::test_suite("golden")) {
    UpscalerOptions options;
    options.views = {"raw", "offsets", "mask"};
    const Golden golden("srpo_x3");
    const Run result = run(golden, options, kViewedFrame + 1);
    for (const std::string& name : options.views) {
        CAPTURE(name);
        CHECK(view_difference(result.upscaler, golden, name) < 5 * kTolerance);
    }
}
