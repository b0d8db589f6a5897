#include "runtime/profiler.h"

#include <doctest/doctest.h>

#include <algorithm>

#include "cl/context.h"
#include "test_device.h"

using namespace clarus;
using namespace clarus::runtime;

namespace {

/// Commands whose events a stage is given.
class Commands {
  public:
    void run(Profiler& profiler, int stage) {
        context_.queue().enqueueFillBuffer(buffer_, cl_uint(1), 0, kBytes, nullptr, profiler.event(stage));
    }

  private:
    static constexpr size_t kBytes = 1 << 16;
    ocl::Context& context_ = test_device().context();
    cl::Buffer buffer_{context_.context(), CL_MEM_READ_WRITE, kBytes};
};

double length(const StageProfile::Span& span) { return span.end - span.start; }

}  // namespace

TEST_SUITE("small") {
    TEST_CASE("a profiler that is off asks for no events") {
        Profiler profiler(false);
        const int stage = profiler.add_stage("a", "kernel", 1, 2);
        profiler.begin_frame();
        CHECK(profiler.event(stage) == nullptr);
        CHECK(profiler.take().empty());
    }

    TEST_CASE("what is kept of a run does not grow with it") {
        Commands commands;
        Profiler profiler(true);
        const int stage = profiler.add_stage("a", "kernel", 1, 2);
        constexpr int kFrames = Profiler::kFramesKept + 20;
        for (int frame = 0; frame < kFrames; ++frame) {
            profiler.begin_frame();
            commands.run(profiler, stage);
        }
        const std::vector<StageProfile> profiles = profiler.take();
        REQUIRE(profiles.size() == 1);
        REQUIRE(profiles[0].spans.size() == Profiler::kFramesKept);
        CHECK(profiles[0].spans.front().frame == 20);
        CHECK(profiles[0].spans.back().frame == kFrames - 1);
    }

    TEST_CASE("a stage's time is the median over frames of the sum of its launches") {
        Commands commands;
        Profiler profiler(true);
        const int once = profiler.add_stage("once", "kernel A", 12, 34), twice = profiler.add_stage("twice", "B", 0, 0);
        profiler.add_stage("never", "C", 0, 0);
        constexpr int kFrames = 3;
        for (int frame = 0; frame < kFrames; ++frame) {
            profiler.begin_frame();
            for (const int stage : {twice, once, twice}) commands.run(profiler, stage);
        }
        const std::vector<StageProfile> profiles = profiler.take();
        REQUIRE(profiles.size() == 2);  // nothing is said of what was not launched
        CHECK(profiles[0].name == "once");
        CHECK(profiles[0].kernel == "kernel A");
        CHECK(profiles[0].operations == 12);
        CHECK(profiles[0].bytes == 34);
        for (size_t i = 0; i < profiles.size(); ++i) {
            const size_t launches = i + 1;
            const auto& spans = profiles[i].spans;
            REQUIRE(spans.size() == kFrames * launches);
            std::vector<double> sums(kFrames, 0);
            for (size_t span = 0; span < spans.size(); ++span) {
                CHECK(spans[span].frame == static_cast<int>(span / launches));
                CHECK(length(spans[span]) >= 0);
                // Starts alone: rusticl gives every fill the constants 2 and 3 ns for its start and its end.
                if (span > 0) CHECK(spans[span].start >= spans[span - 1].start);
                sums[spans[span].frame] += length(spans[span]);
            }
            std::sort(sums.begin(), sums.end());
            CHECK(profiles[i].seconds == doctest::Approx(sums[kFrames / 2]).epsilon(1e-3));
        }
    }

    TEST_CASE("spans are on the host's clock") {
        if (test_device().profile().name.find("llvmpipe") != std::string::npos) return;  // times of fills are constants
        Commands commands;
        Profiler profiler(true);
        const int stage = profiler.add_stage("a", "kernel", 0, 0);
        const auto now = [] {
            return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
        };
        const double before = now();
        for (int frame = 0; frame < 3; ++frame) {
            profiler.begin_frame();
            commands.run(profiler, stage);
        }
        const std::vector<StageProfile> profiles = profiler.take();
        const double after = now();
        constexpr double kTolerance = 1e-3;  // of where a clock is read
        for (const StageProfile::Span& span : profiles.at(0).spans) {
            CHECK(span.start >= before - kTolerance);
            CHECK(span.end <= after + kTolerance);
        }
    }

    TEST_CASE("what was taken is not told again, and frames are counted anew") {
        Commands commands;
        Profiler profiler(true);
        const int stage = profiler.add_stage("a", "kernel", 0, 0);
        profiler.begin_frame();
        profiler.begin_frame();
        commands.run(profiler, stage);
        CHECK(profiler.take().at(0).spans.at(0).frame == 1);
        CHECK(profiler.take().empty());
        profiler.begin_frame();
        commands.run(profiler, stage);
        CHECK(profiler.take().at(0).spans.at(0).frame == 0);
    }
}
