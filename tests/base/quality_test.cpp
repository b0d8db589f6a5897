#include "clarus/quality.h"

#include <doctest/doctest.h>

#include <limits>

#include "clarus/error.h"

using namespace clarus;

TEST_CASE("quality modes: scales that grow, and what follows from a scale") {
    double last = 1;
    for (const std::string& mode : quality_modes()) {
        CAPTURE(mode);
        CHECK(quality_scale(mode) > last);
        last = quality_scale(mode);
    }
    CHECK(last == 3);
    CHECK(quality_render_size({1920, 1080}, quality_scale("quality")) == Size{1280, 720});
    CHECK(quality_render_size({1, 1}, 3) == Size{1, 1});
    CHECK(jitter_count(1) == 8);
    CHECK(jitter_count(1.5) == 18);
    CHECK(jitter_count(3) == 72);
    CHECK(mip_bias(1) == 0);
    CHECK(mip_bias(2) == -1);
    CHECK_THROWS_WITH_AS(quality_scale("best"), doctest::Contains("ultra_quality, quality"), Error);
    CHECK_THROWS_AS(quality_render_size({0, 4}, 2), Error);
    for (const double scale :
         {0.5, -2.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
        CHECK_THROWS_AS(quality_render_size({4, 4}, scale), Error);
        CHECK_THROWS_AS(jitter_count(scale), Error);
        CHECK_THROWS_AS(mip_bias(scale), Error);
    }
}
