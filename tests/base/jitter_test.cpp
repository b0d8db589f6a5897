#include "clarus/jitter.h"

#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <map>
#include <set>

#include "clarus/error.h"

using namespace clarus;

TEST_CASE("Halton jitter is the sequence of docs/conventions.md") {
    const auto check = [](int frame, double x, double y) {
        CHECK(halton_jitter(frame, 16).x == doctest::Approx(x));
        CHECK(halton_jitter(frame, 16).y == doctest::Approx(y));
    };
    check(0, 1.0 / 2 - 0.5, 1.0 / 3 - 0.5);
    check(1, 1.0 / 4 - 0.5, 2.0 / 3 - 0.5);
    check(2, 3.0 / 4 - 0.5, 1.0 / 9 - 0.5);
    check(5, 3.0 / 8 - 0.5, 2.0 / 9 - 0.5);      // 6: 110 and 20
    check(15, 1.0 / 32 - 0.5, 16.0 / 27 - 0.5);  // 16: 10000 and 121
    check(16, 0, 1.0 / 3 - 0.5);
    CHECK(halton_jitter(7, 3) == halton_jitter(1, 3));
}

namespace {

struct SubPixel {
    int a, b;
};

SubPixel sub_pixel(Vec2 jitter, int scale) {
    return {static_cast<int>(std::floor(scale * (0.5 + jitter.x))),
            static_cast<int>(std::floor(scale * (0.5 + jitter.y)))};
}

}  // namespace

TEST_CASE("MNSS jitter is the pattern of docs/conventions.md") {
    int a = 0, b = 0;
    for (int frame = 0; frame < 30; ++frame) {
        CAPTURE(frame);
        CHECK(mnss_jitter(frame, 2) ==
              Vec2{static_cast<float>((a + 0.5) / 2 - 0.5), static_cast<float>((b + 0.5) / 2 - 0.5)});
        a = (a + std::array{1, 0}[frame % 2]) % 2;
        b = (b + std::array{1, 1, 0}[frame % 3]) % 2;
    }
    const std::array<SubPixel, 9> order{{{0, 0}, {1, 1}, {2, 1}, {0, 2}, {2, 0}, {2, 2}, {0, 1}, {1, 2}, {1, 0}}};
    for (int frame = 0; frame < 18; ++frame) {
        const auto [column, row] = order[static_cast<size_t>(frame % 9)];
        const Vec2 jitter = mnss_jitter(frame, 3);
        CHECK(jitter.x == doctest::Approx((column + 0.5) / 3 - 0.5));
        CHECK(jitter.y == doctest::Approx((row + 0.5) / 3 - 0.5));
    }
    CHECK_THROWS_AS(mnss_jitter(0, 4), Error);
}

TEST_CASE("random jitter takes every sub-pixel's centre, about equally often") {
    for (const int scale : {1, 2, 3}) {
        std::map<int, int> taken;
        const int frames = 200 * scale * scale;
        for (int frame = 0; frame < frames; ++frame) {
            const Vec2 jitter = random_jitter(frame, scale);
            CHECK(jitter == random_jitter(frame, scale));
            const auto [a, b] = sub_pixel(jitter, scale);
            CHECK(jitter.x == doctest::Approx((a + 0.5) / scale - 0.5));
            CHECK(jitter.y == doctest::Approx((b + 0.5) / scale - 0.5));
            ++taken[scale * b + a];
        }
        CHECK(taken.size() == static_cast<size_t>(scale * scale));
        for (const auto& [place, count] : taken) {
            CHECK(count > 140);  // four standard deviations of a binomial count of 200 on average
            CHECK(count < 260);
        }
    }
}

TEST_CASE("five frames of MNSS jitter see three sub-pixels of whatever moves by whole output pixels") {
    for (const int scale : {2, 3}) {
        for (int speed = 0; speed < scale * scale; ++speed) {
            for (int first = 0; first < 12; ++first) {
                std::set<int> seen;
                for (int frame = first; frame < first + 5; ++frame) {
                    const auto [a, b] = sub_pixel(mnss_jitter(frame, scale), scale);
                    const int moved_a = (a + frame * (speed % scale)) % scale,
                              moved_b = (b + frame * (speed / scale)) % scale;
                    seen.insert(scale * moved_b + moved_a);
                }
                CHECK(seen.size() >= 3);
            }
        }
    }
}
