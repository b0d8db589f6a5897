#include <doctest/doctest.h>

#include <string>
#include <vector>

#include "golden_harness.h"

using namespace clarus;
using namespace clarus::test;

namespace {

constexpr double kTolerance = 2e-5;  // eight recurrent frames in float against double

}  // namespace

TEST_CASE("MNSS agrees with the PyTorch network over eight frames and a reset" * doctest::test_suite("golden")) {
    for (const char* name : {"mnss_x2", "mnss_x3", "mnss_x2_1x1"}) {
        CAPTURE(name);
        const GoldenRun result = run(Golden(name));
        for (const double difference : result.differences) CHECK(difference < kTolerance);
    }
}

TEST_CASE("MNSS on the smallest image agrees with the PyTorch network" * doctest::test_suite("small")) {
    const GoldenRun result = run(Golden("mnss_x2_1x1"));
    for (const double difference : result.differences) CHECK(difference < kTolerance);
}

TEST_CASE("MNSS shows what it saw inside" * doctest::test_suite("golden")) {
    for (const char* name : {"mnss_x2", "mnss_x3"}) {
        check_views(name, {"weight", "history", "antialiased"}, kTolerance);
        check_views(name, {"weight"}, kTolerance);
        check_views(name, {"history"}, kTolerance);
    }
}

TEST_CASE("MNSS computes the same with all its views kept" * doctest::test_suite("golden")) {
    const Golden golden("mnss_x2");
    UpscalerOptions options;
    options.views = run(golden, {}, 1).upscaler.view_names();
    for (const double difference : run(golden, options).differences) CHECK(difference < kTolerance);
}

TEST_CASE("MNSS in half storage stays near" * doctest::test_suite("golden")) {
    UpscalerOptions options;
    options.precision = Precision::fp16;
    const GoldenRun result = run(Golden("mnss_x3"), options);
    for (const double difference : result.differences) CHECK(difference < 0.02);
}
