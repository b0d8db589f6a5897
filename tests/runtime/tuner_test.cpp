#include "runtime/tuner.h"

#include <doctest/doctest.h>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "cache_folder.h"
#include "clarus/log.h"
#include "io/file.h"
#include "operator_harness.h"
#include "temporary_folder.h"
#include "test_device.h"

using namespace clarus;
using namespace clarus::runtime;

namespace {

const graph::Parameters kParameters{4, 4};

Problem convolution(int width) {
    Problem problem;
    problem.node.op = graph::Convolution{0, graph::Activation::none};
    problem.node.shape = {4, 8, width};
    problem.output = test::pixel_layout(problem.node.shape, Storage::f32);
    problem.inputs = {problem.output};
    problem.parameters = &kParameters;
    return problem;
}

std::filesystem::path tuning_file(const TemporaryFolder& cache) {
    for (const auto& entry : std::filesystem::directory_iterator(cache / "tuning"))
        if (entry.path().extension() == ".json") return entry.path();
    return {};
}

size_t findings(const TemporaryFolder& cache) {
    return nlohmann::json::parse(io::read_file(tuning_file(cache))).at("results").size();
}

}  // namespace

TEST_CASE("what tuners find at the same time adds up") {
    const TemporaryFolder folder;
    const CacheFolder cache(folder.path());
    Tuner one(test_device().context(), Tuning::measure), other(test_device().context(), Tuning::measure);
    const Selection by_one = one.select(convolution(16));
    const Selection by_other = other.select(convolution(24));  // which has not read what the first has written
    CHECK(findings(folder) == 2);

    const Tuner later(test_device().context(), Tuning::stored);
    CHECK(later.select_without_measuring(convolution(16)).describe() == by_one.describe());
    CHECK(later.select_without_measuring(convolution(24)).describe() == by_other.describe());
}

TEST_CASE("the obvious kernel is the last there is, whatever is stored") {
    const TemporaryFolder folder;
    const CacheFolder cache(folder.path());
    Tuner(test_device().context(), Tuning::measure).select(convolution(16));
    const Tuner tuner(test_device().context(), Tuning::obvious);
    CHECK(tuner.select_without_measuring(convolution(16)).implementation ==
          &implementations(convolution(16).node).back());
}

TEST_CASE("a finding that names what does not exist is made anew") {
    const TemporaryFolder folder;
    const CacheFolder cache(folder.path());
    Tuner(test_device().context(), Tuning::measure).select(convolution(16));
    nlohmann::json document = nlohmann::json::parse(io::read_file(tuning_file(folder)));
    for (auto& entry : document.at("results")) entry["implementation"] = "of another release";
    const std::string changed = document.dump();
    io::write_file_atomically(tuning_file(folder), std::as_bytes(std::span(changed)));

    const Tuner reader(test_device().context(), Tuning::stored);
    CHECK(reader.select_without_measuring(convolution(16)).describe() ==
          built_in_selection(convolution(16), test_device().profile()).describe());
    const Selection found = Tuner(test_device().context(), Tuning::measure).select(convolution(16));
    CHECK(io::read_file(tuning_file(folder)).find("of another release") == std::string::npos);
    CHECK(Tuner(test_device().context(), Tuning::stored).select_without_measuring(convolution(16)).describe() ==
          found.describe());
}

TEST_CASE("a tuning folder that cannot be made costs one warning") {
    const TemporaryFolder folder;
    const CacheFolder cache(folder.path());
    std::ofstream(folder / "tuning") << "in the way";
    int warnings = 0;
    set_log_callback([&](LogLevel level, std::string_view) {
        warnings += level == LogLevel::warning;
        throw std::runtime_error("a callback's own trouble");
    });
    Tuner tuner(test_device().context(), Tuning::measure);
    tuner.select(convolution(16));
    tuner.select(convolution(24));
    set_log_callback({});
    CHECK(warnings == 1);
}

TEST_CASE("what is no file at a tuning file's place neither ends nor holds up a run") {
    const TemporaryFolder folder;
    const CacheFolder cache(folder.path());
    Tuner(test_device().context(), Tuning::measure).select(convolution(16));
    const std::filesystem::path file = tuning_file(folder);
    const auto built_in = built_in_selection(convolution(16), test_device().profile()).describe();
    int warnings = 0;
    set_log_callback([&](LogLevel level, std::string_view) { warnings += level == LogLevel::warning; });
    std::filesystem::remove(file);
    SUBCASE("a folder") { std::filesystem::create_directory(file); }
    SUBCASE("a pipe") { REQUIRE(mkfifo(file.c_str(), 0600) == 0); }
    SUBCASE("values that nest deep") {
        const std::string deep = R"({"results": {"a": )" + std::string(200'000, '[') + std::string(200'000, ']') + "}}";
        std::ofstream(file) << deep;
    }
    CHECK(Tuner(test_device().context(), Tuning::stored).select_without_measuring(convolution(16)).describe() ==
          built_in);
    CHECK(warnings == 1);
    set_log_callback({});
}

TEST_CASE("a lock that is held costs the results, not the run") {
    const TemporaryFolder folder;
    const CacheFolder cache(folder.path());
    Tuner(test_device().context(), Tuning::measure).select(convolution(16));
    const int held = open((tuning_file(folder).string() + ".lock").c_str(), O_RDWR);
    REQUIRE(held >= 0);
    REQUIRE(flock(held, LOCK_EX) == 0);
    std::string warning;
    set_log_callback([&](LogLevel level, std::string_view text) {
        if (level == LogLevel::warning) warning = text;
    });
    Tuner(test_device().context(), Tuning::measure).select(convolution(24));
    set_log_callback({});
    close(held);
    CHECK_MESSAGE(warning.find("lock") != std::string::npos, warning);
    CHECK(findings(folder) == 1);
}

TEST_CASE("a damaged tuning file is replaced") {
    const TemporaryFolder folder;
    const CacheFolder cache(folder.path());
    Tuner(test_device().context(), Tuning::measure).select(convolution(16));
    const std::string whole = io::read_file(tuning_file(folder));
    for (const std::string& damaged : {whole.substr(0, whole.size() / 2), std::string(R"({"results": []})")}) {
        io::write_file_atomically(tuning_file(folder), std::as_bytes(std::span(damaged)));
        Tuner(test_device().context(), Tuning::measure).select(convolution(24));
        CHECK(findings(folder) == 1);
    }
}
