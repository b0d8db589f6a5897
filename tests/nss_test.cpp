#include <doctest/doctest.h>

#include <string>
#include <vector>

#include "golden.h"

using namespace clarus;
using namespace clarus::test;

namespace {

constexpr double kTolerance = 5e-5;  // eight recurrent frames in float against double
// Of radiance without bound the variance is a difference of large numbers: PyTorch's own float network is 3e-4 away.
constexpr double kLinearTolerance = 5e-4;

}  // namespace

TEST_CASE("NSS agrees with the PyTorch network over eight frames and a reset" * doctest::test_suite("golden")) {
    for (const char* name : {"nss_x2", "nss_x1.5", "nss_x1.7", "nss_x3", "nss_x2_1x1"}) {
        CAPTURE(name);
        for (const double difference : run(Golden(name)).differences) CHECK(difference < kTolerance);
    }
}

TEST_CASE("NSS of tone-mapped radiance agrees with the PyTorch network" * doctest::test_suite("golden")) {
    for (const double difference : run(Golden("nss_x2_linear")).differences) CHECK(difference < kLinearTolerance);
}

TEST_CASE("NSS on the smallest image agrees with the PyTorch network" * doctest::test_suite("small")) {
    for (const double difference : run(Golden("nss_x2_1x1"), {}, 2).differences) CHECK(difference < kTolerance);
}

TEST_CASE("NSS shows what it saw inside" * doctest::test_suite("golden")) {
    const std::vector<std::string> all = {"disocclusion", "instability", "temporal"};
    for (const std::vector<std::string>& views : {all, {"instability"}}) {
        UpscalerOptions options;
        options.views = views;
        const Golden golden("nss_x1.5");
        const Run result = run(golden, options, kViewedFrame + 1);
        for (const std::string& name : views) {
            CAPTURE(name);
            CHECK(view_difference(result.upscaler, golden, name) < kTolerance);
        }
    }
}

TEST_CASE("NSS computes the same with all its views kept" * doctest::test_suite("golden")) {
    const Golden golden("nss_x3");
    UpscalerOptions options;
    options.views = run(golden, {}, 1).upscaler.view_names();
    for (const double difference : run(golden, options).differences) CHECK(difference < kTolerance);
}

TEST_CASE("NSS in bands agrees with the PyTorch network" * doctest::test_suite("golden")) {
    UpscalerOptions options;
    options.band_rows = 8;
    for (const double difference : run(Golden("nss_x1.5"), options).differences) CHECK(difference < kTolerance);
}

TEST_CASE("NSS in half storage stays near" * doctest::test_suite("golden")) {
    UpscalerOptions options;
    options.precision = Precision::fp16;
    for (const double difference : run(Golden("nss_x1.7"), options).differences) CHECK(difference < 0.02);
}
