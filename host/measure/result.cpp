#include "measure/result.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <span>

#include "base/json_text.h"
#include "base/precision.h"
#include "io/file.h"
#include "measure/commit.h"
#include "measure/device_json.h"

namespace clarus::measure {
namespace {

using Json = nlohmann::ordered_json;

template <typename T>
Json or_null(const std::optional<T>& value) {
    return value ? Json(*value) : Json();
}

Json or_null(const std::string& text) { return text.empty() ? Json() : Json(text); }

const char* name_of(Profile profile) {
    switch (profile) {
        case Profile::quick:
            return "quick";
        case Profile::full:
            return "full";
        case Profile::sustained:
            break;
    }
    return "sustained";
}

const char* name_of(Tuning tuning) {
    switch (tuning) {
        case Tuning::stored:
            return "stored";
        case Tuning::measure:
            return "measure";
        case Tuning::fixed:
            return "fixed";
        case Tuning::obvious:
            break;
    }
    return "obvious";
}

const char* name_of(Check::Result result) {
    switch (result) {
        case Check::Result::passed:
            return "passed";
        case Check::Result::failed:
            return "failed";
        case Check::Result::unchecked:
            break;
    }
    return "unchecked";
}

Json to_json(Size size) { return {size.width, size.height}; }

Json to_json(const Figure& figure) {
    return {{"median", figure.median},
            {"low", figure.low},
            {"high", figure.high},
            {"turns", figure.turns},
            {"relative_interval", figure.relative_interval()},
            {"steady", figure.steady}};
}

Json to_json(const HostFacts& host, Json clocks) {
    return {{"cpu", or_null(host.cpu)},       {"cores", host.cores},
            {"memory", or_null(host.memory)}, {"os", or_null(host.os)},
            {"kernel", host.kernel},          {"governor", or_null(host.governor)},
            {"clock_mhz", std::move(clocks)}, {"load_average", or_null(host.load_average)}};
}

Json to_json(const DeviceResult& device) {
    Json json{{"profile", measure::to_json(device.profile)},
              {"platform_version", device.platform_version},
              {"opencl_c_version", device.opencl_c_version},
              {"compute_peak", to_json(device.compute_peak)},
              {"copy_bandwidth", to_json(device.copy_bandwidth)}};
    if (device.int8_peak) json["int8_peak"] = to_json(*device.int8_peak);
    return json;
}

Json to_json(const StageResult& stage, const DeviceResult& device) {
    return {{"name", stage.name},
            {"kernel", stage.kernel},
            {"seconds", to_json(stage.seconds)},
            {"operations", stage.operations},
            {"bytes", stage.bytes},
            {"compute_share", stage.operations / stage.seconds.median / stage.peak(device)},
            {"bandwidth_share", stage.bytes / stage.seconds.median / device.copy_bandwidth.median}};
}

Json to_json(const Score& score, const DeviceResult& device) {
    Json latency = to_json(score.latency);
    latency.update({{"p95", score.p95}, {"p99", score.p99}, {"frames", score.frames}});
    Json stages = Json::array(), turns = Json::array();
    for (const StageResult& stage : score.stages) stages.push_back(to_json(stage, device));
    for (const TurnResult& turn : score.turns)
        turns.push_back({{"at", turn.at}, {"latency", turn.latency}, {"clock_mhz", or_null(turn.clock_mhz)}});
    return {{"latency", latency},
            {"frames_per_second", to_json(score.frames_per_second)},
            {"device_seconds", to_json(score.device_seconds)},
            {"operations", score.operations()},
            {"bytes", score.bytes()},
            {"roofline_seconds", score.roofline_seconds(device)},
            {"roofline_share", score.roofline_share(device)},
            {"stages", stages},
            {"turns", turns}};
}

Json to_json(const ItemResult& item, const DeviceResult& device) {
    Json json{{"device", item.device},
              {"model",
               {{"name", item.model},
                {"pipeline", item.pipeline},
                {"scale", item.scale},
                {"checksum", or_null(item.checksum)},
                {"parameters", item.parameters}}},
              {"render_size", to_json(item.render_size)},
              {"output_size", to_json(item.output_size)},
              {"precision", clarus::name_of(item.precision)}};
    json["memory"] = item.memory ? Json{{"arena", item.memory->arena},
                                        {"weights", item.memory->weights},
                                        {"total", without_images(*item.memory)}}
                                 : Json();
    json["check"] = {{"result", name_of(item.check.result)},
                     {"largest_difference", or_null(item.check.largest_difference)},
                     {"tolerance", or_null(item.check.tolerance)},
                     {"reason", or_null(item.check.reason)}};
    json["start"] = item.start ? Json{{"cold_seconds", item.start->cold},
                                      {"warm_seconds", item.start->warm},
                                      {"programs", item.start->programs},
                                      {"other_size_seconds", item.start->other_size},
                                      {"other_size_programs", item.start->other_size_programs}}
                               : Json();
    json["score"] = item.score ? to_json(*item.score, device) : Json();
    json["no_score"] = or_null(item.no_score);
    return json;
}

}  // namespace

std::string text_of(Size size) { return fmt::format("{}x{}", size.width, size.height); }

double StageResult::peak(const DeviceResult& device) const {
    constexpr double kBf16 = 2;  // as many products an instruction as of floats
    if (device.int8_peak && kernel.starts_with("int8")) return device.int8_peak->median;
    return (kernel.starts_with("bf16") ? kBf16 : 1) * device.compute_peak.median;
}

double Score::operations() const {
    double sum = 0;
    for (const StageResult& stage : stages) sum += stage.operations;
    return sum;
}

double Score::bytes() const {
    double sum = 0;
    for (const StageResult& stage : stages) sum += stage.bytes;
    return sum;
}

double Score::roofline_seconds(const DeviceResult& device) const {
    double sum = 0;
    for (const StageResult& stage : stages)
        sum += std::max(stage.operations / stage.peak(device), stage.bytes / device.copy_bandwidth.median);
    return sum;
}

const DeviceResult& BenchResult::device_of(const ItemResult& item) const {
    return *std::find_if(devices.begin(), devices.end(),
                         [&](const DeviceResult& device) { return device.profile.selector == item.device; });
}

void BenchResult::write(const std::filesystem::path& path) const {
    Json json{{"format", "clarus-bench"},
              {"version", 1},
              {"suite",
               {{"version", version},
                {"commit", or_null(std::string(kCommit))},
                {"profile", name_of(profile)},
                {"tuning", name_of(tuning)},
                {"confidence", kConfidence},
                {"steady_within", kSteadyWithin}}},
              {"date", date},
              {"seconds", seconds},
              {"host", to_json(host, {or_null(clock_mhz_before), or_null(clock_mhz_after)})}};
    json["devices"] = Json::array();
    json["items"] = Json::array();
    for (const DeviceResult& device : devices) json["devices"].push_back(to_json(device));
    for (const ItemResult& item : items) json["items"].push_back(to_json(item, device_of(item)));
    const std::string text = json_text(json, 2) + "\n";
    io::write_file_atomically(path, std::as_bytes(std::span(text)));
}

}  // namespace clarus::measure
