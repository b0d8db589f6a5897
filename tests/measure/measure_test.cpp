#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>
#include <vector>

#include "clarus/error.h"
#include "measure/bench.h"
#include "measure/checks.h"
#include "measure/comparison.h"
#include "measure/statistics.h"
#include "measure/test_sequence.h"
#include "measure/timed_upscaler.h"
#include "measure/work.h"
#include "temporary_folder.h"
#include "test_device.h"

using namespace clarus;
using namespace clarus::measure;
using nlohmann::json;

namespace {

constexpr Size kRender{32, 18};

std::vector<float> noise(Size size, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> values(0, 1);
    std::vector<float> pixels(size_t{3} * size.width * size.height);
    for (float& pixel : pixels) pixel = values(random);
    return pixels;
}

json figure(double median, double low, double high, int turns = 10) {
    return {{"median", median}, {"low", low}, {"high", high}, {"turns", turns}, {"steady", true}};
}

json device(const std::string& selector, const std::string& name) {
    return {{"profile",
             {{"selector", selector},
              {"name", name},
              {"platform", "made up"},
              {"driver_version", "1"},
              {"opencl_version", "3.0"},
              {"class", "cpu"},
              {"compute_units", 2},
              {"clock_mhz", 1000},
              {"global_memory", 1 << 30},
              {"half_storage", true},
              {"half_arithmetic", false}}},
            {"platform_version", "OpenCL 3.0"},
            {"opencl_c_version", "OpenCL C 1.2"},
            {"compute_peak", figure(100, 99, 102)},
            {"copy_bandwidth", figure(10, 9, 11)}};
}

json item(const std::string& selector, const std::string& model, const json& latency) {
    json measured = latency;
    measured.update({{"p95", 1.0}, {"p99", 1.0}});
    const json stage{{"name", "resample"}, {"kernel", "rows"},     {"seconds", figure(1, 1, 1)}, {"operations", 8},
                     {"bytes", 4},         {"compute_share", 0.5}, {"bandwidth_share", 0}};
    return {{"device", selector},
            {"model", {{"name", model}, {"checksum", nullptr}}},
            {"render_size", {32, 18}},
            {"output_size", {64, 36}},
            {"precision", "fp32"},
            {"memory", nullptr},
            {"check", {{"result", "passed"}, {"reason", nullptr}}},
            {"start", nullptr},
            {"score",
             {{"latency", measured},
              {"frames_per_second", figure(50, 49, 51)},
              {"device_seconds", figure(1, 1, 1)},
              {"operations", 8},
              {"bytes", 4},
              {"roofline_seconds", 0.5},
              {"roofline_share", 0.5},
              {"stages", json::array({stage})}}},
            {"no_score", nullptr}};
}

json results(const std::vector<json>& devices, const std::vector<json>& items) {
    return {{"format", "clarus-bench"},
            {"version", 1},
            {"suite", {{"version", "1"}, {"commit", "aaaa"}, {"profile", "quick"}}},
            {"date", "2026-01-02T03:04:05Z"},
            {"host",
             {{"cpu", nullptr},
              {"cores", 2},
              {"os", nullptr},
              {"kernel", "Linux"},
              {"governor", nullptr},
              {"clock_mhz", {nullptr, nullptr}},
              {"load_average", nullptr}}},
            {"devices", devices},
            {"items", items}};
}

Comparison compare_files(const json& a, const json& b) {
    const TemporaryFolder folder;
    std::ofstream(folder / "a.json") << a;
    std::ofstream(folder / "b.json") << b;
    return compare(folder / "a.json", folder / "b.json");
}

}  // namespace

TEST_CASE("quantiles are values that occur") {
    const std::vector<double> values{5, 1, 4, 2, 3};
    CHECK(quantile(values, 0.95) == 5);
    CHECK(quantile(values, 0.6) == 3);
    CHECK(quantile(values, 0.61) == 4);
    CHECK(quantile(std::vector{7.0}, 0.99) == 7);
    CHECK(median(values) == 3);
    CHECK(median(std::vector<double>{4, 1, 2, 3}) == 2.5);
}

TEST_CASE("a median's interval is that of the tables of the sign test") {
    for (const int few : {1, 2, 5}) CHECK(!median_ranks(few));
    // 6: 1 − 2/64 = 0.969. 9: 1 − 2·10/512 = 0.961. 20: from the 6th to the 15th. 100: from the 40th to the 61st.
    CHECK(median_ranks(6) == std::pair(0, 5));
    CHECK(median_ranks(8) == std::pair(0, 7));
    CHECK(median_ranks(9) == std::pair(1, 7));
    CHECK(median_ranks(20) == std::pair(5, 14));
    CHECK(median_ranks(100) == std::pair(39, 60));
    const auto many = median_ranks(10000);
    REQUIRE(many);
    CHECK(many->first == doctest::Approx(5000 - 1.96 * 50).epsilon(0.001));
    CHECK(median_ranks(1'000'000)->first == doctest::Approx(500'000 - 1.96 * 500).epsilon(0.00001));
}

TEST_CASE("a figure is steady where enough turns agree") {
    const Figure few = summarise(std::vector<double>{1, 1, 1});
    CHECK(few.turns == 3);
    CHECK(!few.steady);
    const Figure figure = summarise(std::vector<double>{103, 99, 100, 101, 100, 102, 98, 300, 97});
    CHECK(figure.median == 100);
    CHECK(figure.low == 98);
    CHECK(figure.high == 103);
    CHECK(figure.relative_interval() == doctest::Approx(0.025));
    CHECK(!figure.steady);
    CHECK(summarise(std::vector<double>{100, 101, 100, 102, 100, 99}).steady);
}

TEST_CASE("a ratio is a change where its interval leaves out 1") {
    const Figure a{100, 98, 104, 10, true}, b{80, 78, 82, 10, true};
    const Ratio faster = ratio(a, b);
    CHECK(faster.value == doctest::Approx(0.8));
    CHECK(faster.low == doctest::Approx(0.75));
    CHECK(faster.high == doctest::Approx(82.0 / 98));
    CHECK(faster.is_change());
    CHECK(!ratio(a, {97, 95, 101, 10, true}).is_change());
    CHECK(ratio(b, a).is_change());
}

TEST_CASE("the test sequence is the same everywhere, moves, and says where everything was") {
    const TestFrame first = test_frame({64, 36}, 3), again = test_frame({64, 36}, 3), other = test_frame({64, 36}, 4);
    CHECK(first.color == again.color);
    CHECK(first.color != other.color);
    uint32_t bits = 0;
    for (const auto* values : {&first.color, &first.depth, &first.motion})
        for (const float value : *values) bits = hash(bits ^ static_cast<uint32_t>(std::lround(65536 * value)));
    CHECK(bits == 2051413755);
    for (const float value : first.color) CHECK((value >= 0 && value <= 1));

    // Following the motion leads to about the same colour, for the ground is smooth on the whole.
    double followed = 0, stayed = 0;
    int count = 0;
    for (int y = 4; y < 32; ++y) {
        for (int x = 4; x < 60; ++x) {
            const int pixel = y * 64 + x;
            const int from_x = x + static_cast<int>(std::lround(other.motion[2 * pixel]));
            const int from_y = y + static_cast<int>(std::lround(other.motion[2 * pixel + 1]));
            if (from_x < 0 || from_y < 0 || from_x >= 64 || from_y >= 36) continue;
            followed += std::abs(other.color[3 * pixel] - first.color[3 * (from_y * 64 + from_x)]);
            stayed += std::abs(other.color[3 * pixel] - first.color[3 * pixel]);
            ++count;
        }
    }
    CHECK(count > 1000);
    CHECK(followed < 0.7 * stayed);
}

TEST_CASE("sketches differ by as much as the images") {
    const Size size{161, 90};
    const std::vector<float> image = noise(size, 1), error = noise(size, 2);
    CHECK(difference(sketch(size, image), sketch(size, image)) == 0);
    for (const float strength : {1e-4f, 1e-2f, 0.5f}) {
        std::vector<float> wrong = image;
        for (size_t i = 0; i < wrong.size(); ++i) wrong[i] += strength * (2 * error[i] - 1);
        // The error's root mean square is strength/√3; the largest of 64 estimates is about 2.5 times that.
        const double found = difference(sketch(size, image), sketch(size, wrong));
        CHECK(found > 0.5 * strength);
        CHECK(found < 3 * strength);
    }
    std::vector<float> shifted(image.begin() + 3, image.end());
    shifted.resize(image.size());
    CHECK(difference(sketch(size, image), sketch(size, shifted)) > tolerance(Precision::fp16));
    std::vector<float> black_tile = image;  // of 10×10 pixels
    for (int y = 40; y < 50; ++y)
        for (int x = 80; x < 90; ++x) black_tile[3 * (y * size.width + x)] = 0;
    CHECK(difference(sketch(size, image), sketch(size, black_tile)) > tolerance(Precision::fp16));
    std::vector<float> broken = image;
    broken[1000] = std::numeric_limits<float>::quiet_NaN();
    CHECK(std::isnan(difference(sketch(size, image), sketch(size, broken))));
    CHECK(sketch({1, 1}, {1, 1, 1})[0] != 0);
}

TEST_CASE("checks are of a model's weights, scale and size") {
    const TemporaryFolder folder;
    const Model network = Model::load(CLARUS_GOLDEN_DIR "/enss_x2_table.model.safetensors");
    Checks checks;
    Sketch values{};
    for (size_t i = 0; i < values.size(); ++i) values[i] = 0.25f * static_cast<float>(i) - 3;
    checks.set(network, kRender, values);
    checks.set(Model::filter("bicubic", 1.5), kRender, Sketch{});
    checks.write(folder / "checks.json");
    const Checks read = Checks::read(folder / "checks.json");
    REQUIRE(read.find(network, kRender));
    CHECK(*read.find(network, kRender) == values);
    CHECK(!read.find(network, {32, 19}));
    CHECK(read.find(Model::filter("bicubic", 1.5), kRender));
    CHECK(!read.find(Model::filter("bicubic", 2), kRender));

    // Another network of the same name.
    std::filesystem::copy(CLARUS_GOLDEN_DIR "/enss_x2_1x1.model.safetensors",
                          folder / "enss_x2_table.model.safetensors");
    CHECK(!read.find(Model::load(folder / "enss_x2_table.model.safetensors"), kRender));
    CHECK_THROWS_AS(Checks::read(folder / "none.json"), Error);
    std::ofstream(folder / "wrong.json") << R"({"format": "clarus-bench-checks", "version": 1, "checks": [{}]})";
    CHECK_THROWS_AS(Checks::read(folder / "wrong.json"), Error);
}

TEST_CASE("profiles: models, sizes and precisions") {
    BenchOptions options;
    options.devices = {test_selector()};
    const Checks checks = Checks::read(shipped_checks());
    for (const BenchItem& item : bench_items(options)) {
        CAPTURE(item.model.name());
        CHECK(checks.find(item.model, item.render_size));  // retrained weights want new expected images
        CHECK(std::abs(item.render_size.width * item.model.scale() - 1920) <= item.model.scale() / 2);
        CHECK(item.model.name().find("-x3") == std::string::npos);  // there is a smaller scale of each
    }
    options.profile = Profile::full;
    for (const BenchItem& item : bench_items(options)) {
        CAPTURE(item.model.name());
        CAPTURE(item.render_size.width);
        CHECK(checks.find(item.model, item.render_size));
    }
    options.models = {"bicubic"};
    const size_t precisions = test_device().profile().half_storage ? 2 : 1;
    CHECK(bench_items(options).size() == 4 * precisions);
    options.profile = Profile::sustained;
    options.models.clear();
    CHECK(bench_items(options).size() == 1);
}

TEST_CASE("what is timed is checked against the obvious kernels, in both precisions") {
    BenchOptions options;
    options.devices = {test_selector()};
    options.models = {CLARUS_GOLDEN_DIR "/enss_x2_table.model.safetensors", "fsr2"};
    options.sizes = {{64, 36}};
    options.precisions = {Precision::fp32, Precision::fp16};
    options.seconds = 1e-3;
    const std::vector<BenchItem> items = bench_items(options);
    REQUIRE(items.size() == 4);
    for (const BenchItem& each : items) {
        const bool is_first = each.precision == Precision::fp32;
        CHECK(add_check(options.checks, each) == is_first);
    }
    double done = 0;
    const BenchResult result = run_bench(options, items, [&](double fraction) {
        CHECK(fraction >= 0);
        CHECK(fraction <= 1);
        done = fraction;
    });
    CHECK(done == 1);
    REQUIRE(result.items.size() == 4);
    for (const ItemResult& item : result.items) {
        CAPTURE(item.model);
        CAPTURE(item.check.reason);
        CHECK(item.check.result == Check::Result::passed);
        CHECK(item.no_score == "");
        REQUIRE(item.score);
        CHECK(item.score->latency.turns >= 6);
        CHECK(item.score->frames == item.score->latency.turns * (kSequenceFrames - 1));
        CHECK(item.score->p95 >= item.score->latency.median);
        CHECK(item.score->stages.size() > 2);
        CHECK(item.score->device_seconds.median > 0);
    }
    CHECK(result.devices.size() == 1);
    CHECK(result.devices[0].compute_peak.turns >= 6);
}

TEST_CASE("an image that is not the expected one has no score, nor has a model that does not fit its device") {
    BenchOptions options;
    options.devices = {test_selector()};
    options.models = {"bilinear", "bicubic"};
    options.sizes = {{64, 36}};
    options.precisions = {Precision::fp32};
    options.seconds = 1e-3;
    const std::vector<BenchItem> items = bench_items(options);
    Sketch wrong{};
    wrong[5] = std::numeric_limits<float>::quiet_NaN();
    options.checks.set(items[0].model, items[0].render_size, wrong);
    options.checks.set(items[1].model, items[1].render_size, Sketch{});
    const BenchResult result = run_bench(options, items, {});
    for (const ItemResult& item : result.items) {
        CHECK(item.check.result == Check::Result::failed);
        CHECK(!item.score);
        CHECK(item.no_score.find("not the expected one") != std::string::npos);
    }
}

TEST_CASE("two runs are compared by what they have in common") {
    const json a = results({device("0:0", "chip")}, {item("0:0", "bicubic", figure(0.010, 0.0098, 0.0104)),
                                                     item("0:0", "lanczos", figure(0.020, 0.019, 0.021)),
                                                     item("0:0", "fsr1", figure(0.03, 0.03, 0.03))});
    json b = results({device("0:0", "chip")}, {item("0:0", "lanczos", figure(0.0205, 0.0195, 0.0215)),
                                               item("0:0", "bicubic", figure(0.008, 0.0078, 0.0082)),
                                               item("0:0", "fsr2", figure(0.03, 0.03, 0.03))});
    b["suite"]["commit"] = "bbbb";
    b["devices"][0]["profile"]["driver_version"] = "2";
    b["items"][1]["score"]["stages"][0]["kernel"] = "tiles";
    b["items"][1]["score"]["stages"][0]["seconds"] = figure(0.25, 0.24, 0.26);
    const Comparison comparison = compare_files(a, b);
    REQUIRE(comparison.items.size() == 2);
    const ItemChange& bicubic = comparison.items[0];
    CHECK(bicubic.model == "bicubic");
    REQUIRE(bicubic.latency);
    CHECK(bicubic.latency->b_over_a.value == doctest::Approx(0.8));
    CHECK(bicubic.latency->b_over_a.low == doctest::Approx(0.75));
    CHECK(bicubic.latency->b_over_a.high == doctest::Approx(0.0082 / 0.0098));
    CHECK(bicubic.latency->b_over_a.is_change());
    CHECK(bicubic.latency->is_bounded());
    CHECK(!comparison.items[1].latency->b_over_a.is_change());
    CHECK(comparison.only_a == std::vector<std::string>{"fsr1 64x36 fp32"});
    CHECK(comparison.only_b == std::vector<std::string>{"fsr2 64x36 fp32"});
    REQUIRE(comparison.facts.size() == 3);
    CHECK(comparison.facts[0].what == "commit");
    CHECK(comparison.facts[0].b == "bbbb");
    CHECK(comparison.facts[1].what == "chip: driver");
    CHECK(comparison.facts[2].what == "bicubic 64x36 fp32: kernel of resample");
    CHECK(comparison.facts[2].a == "rows");
    CHECK(comparison.facts[2].b == "tiles");
    REQUIRE(bicubic.stages.size() == 1);
    CHECK(bicubic.stages[0].name == "resample");
    CHECK(bicubic.stages[0].seconds.b_over_a.value == doctest::Approx(0.25));
}

TEST_CASE("devices of two machines are paired by their names, then in their order") {
    const json a = results({device("0:0", "one"), device("1:0", "two")}, {item("1:0", "bicubic", figure(1, 1, 1, 3))});
    json b = results({device("0:0", "two"), device("0:1", "three")}, {item("0:0", "bicubic", figure(2, 2, 2))});
    Comparison comparison = compare_files(a, b);
    REQUIRE(comparison.devices.size() == 2);
    CHECK(comparison.devices[0].b == "three");
    CHECK(comparison.devices[1].b == "two");
    REQUIRE(comparison.items.size() == 1);
    CHECK(comparison.devices[comparison.items[0].device].b == "two");
    CHECK(!comparison.items[0].latency->is_bounded());

    b["items"][0]["score"] = nullptr;
    b["items"][0]["no_score"] = "it was wrong";
    comparison = compare_files(a, b);
    CHECK(!comparison.items[0].latency);
    CHECK(comparison.items[0].no_score == "B: it was wrong");

    // A device that the other file lacks.
    comparison = compare_files(a, results({device("0:0", "one")}, {item("0:0", "bicubic", figure(1, 1, 1))}));
    CHECK(comparison.items.empty());
    CHECK(comparison.only_a == std::vector<std::string>{"two (1:0): bicubic 64x36 fp32"});
    CHECK(comparison.only_b == std::vector<std::string>{"one (0:0): bicubic 64x36 fp32"});
}

TEST_CASE("files that hold no results are refused") {
    const json good = results({device("0:0", "chip")}, {item("0:0", "bicubic", figure(1, 1, 1))});
    CHECK_THROWS_AS(compare_files({{"format", "something"}}, good), Error);
    CHECK_THROWS_AS(compare_files(json::array(), good), Error);
    json broken = good;
    broken["items"][0]["score"]["latency"]["median"] = 0;
    CHECK_THROWS_WITH_AS(compare_files(good, broken), doctest::Contains("items[0].score.latency.median"), Error);
    broken = good;
    broken["items"][0]["device"] = "0:1";
    CHECK_THROWS_WITH_AS(compare_files(good, broken), doctest::Contains("items[0].device"), Error);
    broken = good;
    broken["items"][0]["score"]["latency"]["turns"] = 2147483647;
    CHECK_THROWS_WITH_AS(compare_files(good, broken), doctest::Contains("items[0].score.latency.turns"), Error);
    broken = good;
    broken["devices"] = 3;
    CHECK_THROWS_AS(compare_files(good, broken), Error);
}

TEST_CASE("kernels in whole numbers are measured by the peak of bytes, where there is one") {
    measure::DeviceResult device;
    device.compute_peak.median = 100;
    device.copy_bandwidth.median = 1000;
    const auto stage = [](const char* kernel) {
        measure::StageResult result;
        result.kernel = kernel;
        result.operations = 800;
        result.bytes = 1;
        return result;
    };
    measure::Score score;
    score.stages = {stage("int8 tiled"), stage("tiled")};
    CHECK(score.roofline_seconds(device) == doctest::Approx(16));
    device.int8_peak = device.compute_peak;
    device.int8_peak->median = 400;
    CHECK(score.stages[0].peak(device) == 400);
    CHECK(score.stages[1].peak(device) == 100);
    CHECK(score.roofline_seconds(device) == doctest::Approx(10));
}

TEST_CASE("the peak of bytes is measured where the profile has the instruction") {
    const Device device = test_device();
    const auto sweep = measure::int8_peak_sweep(device);
    CHECK(sweep.empty() != device.profile().vnni);
    for (const measure::Work& work : sweep) {
        CHECK(work.operations > 0);
        CHECK(work.run() > 0);
    }
}
