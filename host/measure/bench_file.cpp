#include "measure/bench_file.h"

#include <limits>
#include <set>
#include <string>

namespace clarus::measure {
namespace {

using io::JsonNode;

constexpr double kMost = std::numeric_limits<double>::max(), kLeast = std::numeric_limits<double>::min();
constexpr int64_t kMostTurns = 1'000'000;
constexpr int64_t kMostWhole = std::numeric_limits<int64_t>::max();

void check_text_or_null(const JsonNode& node) {
    if (!node.is_null()) node.text();
}

void check_number_or_null(const JsonNode& node) {
    if (!node.is_null()) node.number(0, kMost);
}

void check_size(const JsonNode& size) {
    for (const JsonNode& side : size.items(2)) side.integer(1, 1 << 15);
}

void check_stage(const JsonNode& stage) {
    stage["name"].text();
    stage["kernel"].text();
    read_figure(stage["seconds"]);
    for (const char* key : {"operations", "bytes", "compute_share", "bandwidth_share"}) stage[key].number(0, kMost);
}

void check_score(const JsonNode& score) {
    for (const char* key : {"latency", "frames_per_second", "device_seconds"}) read_figure(score[key]);
    for (const char* key : {"p95", "p99"}) score["latency"][key].number(kLeast, kMost);
    for (const char* key : {"operations", "bytes", "roofline_seconds", "roofline_share"}) score[key].number(0, kMost);
    if (score["stages"].items().empty()) score["stages"].refuse("a list of one stage or more");
    for (const JsonNode& stage : score["stages"].items()) check_stage(stage);
}

void check_item(const JsonNode& item, const std::set<std::string>& devices) {
    if (!devices.contains(item["device"].text())) item["device"].refuse("the selector of one of the devices");
    item["model"]["name"].text();
    item["precision"].text();
    check_size(item["render_size"]);
    check_size(item["output_size"]);
    item["check"]["result"].text();
    check_text_or_null(item["check"]["reason"]);
    if (!item["memory"].is_null()) item["memory"]["total"].integer(0, kMostWhole);
    if (!item["start"].is_null())
        for (const char* key : {"cold_seconds", "warm_seconds", "other_size_seconds"})
            item["start"][key].number(kLeast, kMost);
    check_text_or_null(item["no_score"]);
    if (item["score"].is_null())
        item["no_score"].text();
    else
        check_score(item["score"]);
}

void check_suite(const JsonNode& suite) {
    for (const char* key : {"version", "profile"}) suite[key].text();
    check_text_or_null(suite["commit"]);
}

void check_host(const JsonNode& host) {
    for (const char* key : {"cpu", "os", "governor"}) check_text_or_null(host[key]);
    host["kernel"].text();
    host["cores"].integer(1, kMostWhole);
    for (const JsonNode& clock : host["clock_mhz"].items(2)) check_number_or_null(clock);
    check_number_or_null(host["load_average"]);
}

void check_device(const JsonNode& device) {
    const JsonNode profile = device["profile"];
    for (const char* key : {"selector", "name", "driver_version", "opencl_version", "class"}) profile[key].text();
    for (const char* key : {"compute_units", "clock_mhz", "global_memory"}) profile[key].integer(0, kMostWhole);
    for (const char* key : {"half_storage", "half_arithmetic"}) profile[key].boolean();
    for (const char* key : {"platform_version", "opencl_c_version"}) device[key].text();
    for (const char* key : {"compute_peak", "copy_bandwidth"}) read_figure(device[key]);
    if (const auto peak = device.find("int8_peak")) read_figure(*peak);
}

}  // namespace

Figure read_figure(const JsonNode& node) {
    Figure figure;
    figure.median = node["median"].number(kLeast, kMost);
    figure.low = node["low"].number(kLeast, kMost);
    figure.high = node["high"].number(kLeast, kMost);
    figure.turns = static_cast<int>(node["turns"].integer(1, kMostTurns));
    figure.steady = node["steady"].boolean();
    return figure;
}

BenchFile::BenchFile(const std::filesystem::path& from) : path(from), json(io::read_json(from)) {
    root()["format"].choice<int>({{"clarus-bench", 1}});
    root()["version"].integer(1, 1);
    root()["date"].text();
    check_suite(root()["suite"]);
    check_host(root()["host"]);
    std::set<std::string> devices;
    for (const JsonNode& device : root()["devices"].items()) {
        check_device(device);
        devices.insert(device["profile"]["selector"].text());
    }
    for (const JsonNode& item : root()["items"].items()) check_item(item, devices);
}

}  // namespace clarus::measure
