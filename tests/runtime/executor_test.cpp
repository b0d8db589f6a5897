#include "runtime/executor.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <limits>

#include "test_device.h"

using namespace clarus;
using namespace clarus::runtime;

namespace {

constexpr Size kSize{5, 3};
constexpr size_t kPixels = 15;

/// An executor of a graph on the device under test.
struct Running {
    explicit Running(const graph::Graph& graph, PlanOptions given = {}) : options(std::move(given)) {
        const DeviceProfile profile = test_device().profile();
        plan = make_plan(graph, options, profile,
                         [&](const Problem& problem) { return built_in_selection(problem, profile); });
        executor.emplace(test_device().context(), *plan, std::span<const std::unique_ptr<Plan>>(), options, HandedIn{},
                         [this](double done) { progress.push_back(done); });
    }

    /// A frame of one colour; its first pixel's red.
    float run(float value) {
        std::vector<float> color(3 * kPixels, value), output(3 * kPixels, -1);
        FrameDescription frame;
        frame.color = {.host = color.data(), .size = kSize};
        frame.output = {.host = output.data(), .size = kSize};
        executor->submit(frame, {})->done.wait();
        for (const float each : output) CHECK(each == output[0]);
        return output[0];
    }

    PlanOptions options;
    std::unique_ptr<Plan> plan;
    std::vector<double> progress;
    std::optional<Executor> executor;
};

/// output = colour / 2 + what the frame before's output was / 4.
graph::Graph accumulation() {
    graph::Graph graph;
    const graph::Value color = graph.input(graph::Resource::color, kSize);
    const graph::Value before = graph.previous({3, kSize.height, kSize.width}, "history");
    graph.output = graph.linear({color, before}, {0.5f, 0.25f}, 0, "accumulated");
    graph.carry(before, graph.output);
    return graph;
}

}  // namespace

TEST_CASE("states hand a frame's values on to the next, from zero") {
    Running running(accumulation());
    CHECK_FALSE(running.executor->has_run());
    float before = 0;
    for (const float color : {1.0f, 0.25f, 0.0f, 0.5f, 1.0f}) {
        const float expected = color / 2 + before / 4;
        before = running.run(color);
        CHECK(before == doctest::Approx(expected).epsilon(1e-6));
    }
    CHECK(running.executor->has_run());
}

TEST_CASE("two executors of one plan's kind do not share their states") {
    Running one(accumulation()), other(accumulation());
    one.run(1);
    CHECK(other.run(0) == 0);
    CHECK(one.run(0) == doctest::Approx(0.125));
}

TEST_CASE("views are read after a frame") {
    graph::Graph graph = accumulation();
    graph.views["accumulated"] = graph.output;
    PlanOptions options;
    options.views = {"accumulated"};
    Running running(graph, options);
    const float shown = running.run(0.5f);
    const std::vector<float> view = running.executor->read(running.plan->layout.graph.views.at("accumulated"));
    CHECK(view == std::vector<float>(3 * kPixels, shown));
}

TEST_CASE("progress ends at one") {
    const Running running(accumulation());
    REQUIRE_FALSE(running.progress.empty());
    CHECK(running.progress.back() == 1);
    for (size_t i = 1; i < running.progress.size(); ++i) CHECK(running.progress[i] >= running.progress[i - 1]);
}

TEST_CASE("invalid motion vectors are counted frame by frame") {
    graph::Graph graph;
    const graph::Value color = graph.input(graph::Resource::color, kSize);
    const graph::Value valid = graph.validity(graph.input(graph::Resource::motion, kSize));
    graph.output = graph.product(color, valid, "valid colour");
    Running running(graph);
    std::vector<float> pixels(3 * kPixels, 1), motion(2 * kPixels, 0), output(3 * kPixels);
    FrameDescription frame;
    frame.color = {.host = pixels.data(), .size = kSize};
    frame.motion = {.host = motion.data(), .size = kSize};
    frame.output = {.host = output.data(), .size = kSize};
    motion[6] = std::numeric_limits<float>::quiet_NaN();
    motion[29] = std::numeric_limits<float>::infinity();
    const auto first = running.executor->submit(frame, {});
    first->done.wait();
    motion.assign(motion.size(), 0);
    const auto second = running.executor->submit(frame, {});
    second->done.wait();
    CHECK(first->invalid_motion_vectors == 2);
    CHECK(second->invalid_motion_vectors == 0);
}

TEST_CASE("with a profile, every stage of every frame has its time, and none that was run to compile") {
    PlanOptions options;
    options.profile = true;
    // Colours that are shown as they are made are written by who makes them.
    SUBCASE("presented as they are made") {}
    SUBCASE("presented as light") { options.color_space = ColorSpace::linear; }
    Running running(accumulation(), options);
    for (int frame = 0; frame < 2; ++frame) running.run(1);
    std::vector<std::string> names;
    for (const StageProfile& stage : running.executor->profiler().take()) {
        names.push_back(stage.name);
        CHECK(stage.spans.size() == 2);
    }
    CHECK(names.front() == "ingest");
    const auto has = [&](const char* name) { return std::find(names.begin(), names.end(), name) != names.end(); };
    for (const char* name : {"upload", "read back", "accumulated"}) CHECK(has(name));
    CHECK(has("present") == (options.color_space == ColorSpace::linear));
}
