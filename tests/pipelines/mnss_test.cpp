#include <doctest/doctest.h>

#include <string>
#include <vector>

#include "golden.h"

using namespace clarus;
using namespace clarus::test;

namespace {

constexpr double kTolerance = 2e-5;  // eight recurrent frames in float against double

}  // namespace

TEST_CASE("MNSS agrees with the PyTorch network over eight frames and a reset" * doctest::test_suite("golden")) {
    for (const char* name : {"mnss_x2", "mnss_x3", "mnss_x2_1x1", "mnss_x2_checked"}) {
        CAPTURE(name);
        const Run result = run(Golden(name));
        for (const double difference : result.differences) CHECK(difference < kTolerance);
    }
}

TEST_CASE("MNSS on the smallest image agrees with the PyTorch network" * doctest::test_suite("small")) {
    const Run result = run(Golden("mnss_x2_1x1"));
    for (const double difference : result.differences) CHECK(difference < kTolerance);
}

TEST_CASE("MNSS shows what it saw inside" * doctest::test_suite("golden")) {
    const std::vector<std::string> all = {"weight", "history", "antialiased"};
    for (const std::vector<std::string>& views : {all, {"history"}}) {
        UpscalerOptions options;
        options.views = views;
        const Golden golden("mnss_x3");
        const Run result = run(golden, options, kViewedFrame + 1);
        for (const std::string& name : views) {
            CAPTURE(name);
            CHECK(view_difference(result.upscaler, golden, name) < kTolerance);
        }
    }
}

TEST_CASE("MNSS computes the same with all its views kept" * doctest::test_suite("golden")) {
    const Golden golden("mnss_x2");
    UpscalerOptions options;
    options.views = run(golden, {}, 1).upscaler.view_names();
    for (const double difference : run(golden, options).differences) CHECK(difference < kTolerance);
}

TEST_CASE("MNSS in bands agrees with the PyTorch network" * doctest::test_suite("golden")) {
    UpscalerOptions options;
    options.band_rows = 8;
    for (const double difference : run(Golden("mnss_x3"), options).differences) CHECK(difference < kTolerance);
}

TEST_CASE("MNSS in half storage stays near" * doctest::test_suite("golden")) {
    UpscalerOptions options;
    options.precision = Precision::fp16;
    const Run result = run(Golden("mnss_x3"), options);
    for (const double difference : result.differences) CHECK(difference < 0.02);
}
