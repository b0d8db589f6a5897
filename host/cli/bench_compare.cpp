#include "cli/bench_compare.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/json_text.h"
#include "measure/comparison.h"
#include "measure/result.h"

namespace clarus::cli {
namespace {

using measure::Change;
using measure::Comparison;
using Json = nlohmann::ordered_json;

/// Of times less is better, of rates more.
enum class Better { less, more };

const char* verdict(const Change& change, Better better) {
    if (!change.is_bounded()) return "too few turns to tell";
    if (!change.b_over_a.is_change()) return "within the noise";
    return (change.b_over_a.value < 1) == (better == Better::less) ? "faster" : "slower";
}

Json to_json(const Change& change, Better better) {
    return {{"a", change.a.median},       {"b", change.b.median},         {"ratio", change.b_over_a.value},
            {"low", change.b_over_a.low}, {"high", change.b_over_a.high}, {"verdict", verdict(change, better)}};
}

Json to_json(const Comparison& comparison) {
    Json json{{"confidence", 2 * measure::kConfidence - 1},
              {"facts", Json::array()},
              {"devices", Json::array()},
              {"items", Json::array()},
              {"only_a", comparison.only_a},
              {"only_b", comparison.only_b}};
    for (const measure::Fact& fact : comparison.facts)
        json["facts"].push_back({{"what", fact.what}, {"a", fact.a}, {"b", fact.b}});
    for (const measure::DeviceChange& device : comparison.devices)
        json["devices"].push_back({{"a", device.a},
                                   {"b", device.b},
                                   {"compute_peak", to_json(device.compute_peak, Better::more)},
                                   {"copy_bandwidth", to_json(device.copy_bandwidth, Better::more)}});
    for (const measure::ItemChange& item : comparison.items) {
        Json entry{{"device_a", comparison.devices[item.device].a},
                   {"device_b", comparison.devices[item.device].b},
                   {"model", item.model},
                   {"output_size", {item.output_size.width, item.output_size.height}},
                   {"precision", item.precision}};
        entry["latency"] = item.latency ? to_json(*item.latency, Better::less) : Json();
        entry["frames_per_second"] = item.frames_per_second ? to_json(*item.frames_per_second, Better::more) : Json();
        entry["no_score"] = item.no_score.empty() ? Json() : Json(item.no_score);
        entry["stages"] = Json::array();
        for (const measure::StageChange& stage : item.stages) {
            Json change{{"name", stage.name}};
            change.update(to_json(stage.seconds, Better::less));
            entry["stages"].push_back(std::move(change));
        }
        json["items"].push_back(std::move(entry));
    }
    return json;
}

std::string interval(const measure::Ratio& ratio) {
    return fmt::format("{:>6.3f} ({:.3f} to {:.3f})", ratio.value, ratio.low, ratio.high);
}

void print_device(const measure::DeviceChange& device) {
    fmt::print("{}{}\n", device.a, device.a == device.b ? "" : " and " + device.b);
    const auto line = [](const char* name, const char* unit, const Change& change) {
        fmt::print("  {:<14} {:>8.1f} {:>8.1f} {:<8} {:<26} {}\n", name, 1e-9 * change.a.median, 1e-9 * change.b.median,
                   unit, interval(change.b_over_a), verdict(change, Better::more));
    };
    line("compute peak", "GFLOP/s", device.compute_peak);
    line("copy bandwidth", "GB/s", device.copy_bandwidth);
}

/// The stages that account for most of an item's change.
void print_stages(const measure::ItemChange& item) {
    constexpr size_t kMost = 3;
    std::vector<const measure::StageChange*> changed;
    for (const measure::StageChange& stage : item.stages)
        if (stage.seconds.is_bounded() && stage.seconds.b_over_a.is_change()) changed.push_back(&stage);
    const auto size = [](const measure::StageChange* stage) {
        return std::abs(stage->seconds.b.median - stage->seconds.a.median);
    };
    std::stable_sort(changed.begin(), changed.end(), [&](const auto* a, const auto* b) { return size(a) > size(b); });
    if (changed.size() > kMost) changed.resize(kMost);
    for (const measure::StageChange* stage : changed)
        fmt::print("    {}: {:.3f} ms, {:.3f} ms, {}\n", stage->name, 1e3 * stage->seconds.a.median,
                   1e3 * stage->seconds.b.median, verdict(stage->seconds, Better::less));
}

void print_items(const Comparison& comparison, size_t device) {
    size_t width = 5;
    for (const measure::ItemChange& item : comparison.items) width = std::max(width, item.model.size());
    fmt::print("\n{:<{}}  {:>10}  {:<4}  {:>9}  {:>9}   {:<25}  {:<25}\n", "model", width, "output", "", "A, ms",
               "B, ms", "B / A", "frames a second, B / A");
    for (const measure::ItemChange& item : comparison.items) {
        if (item.device != device) continue;
        fmt::print("{:<{}}  {:>10}  {:<4}  ", item.model, width, measure::text_of(item.output_size), item.precision);
        if (!item.latency) {
            fmt::print("no score in {}\n", item.no_score);
            continue;
        }
        fmt::print("{:>9.2f}  {:>9.2f}   {:<25}  {:<25}  {}\n", 1e3 * item.latency->a.median,
                   1e3 * item.latency->b.median, interval(item.latency->b_over_a),
                   interval(item.frames_per_second->b_over_a), verdict(*item.latency, Better::less));
        print_stages(item);
    }
    fmt::print("\n");
}

void print(const Comparison& comparison) {
    for (size_t device = 0; device < comparison.devices.size(); ++device) {
        print_device(comparison.devices[device]);
        print_items(comparison, device);
    }
    fmt::print(
        "In brackets: where the ratio is with a confidence of at least {:.0f} %, were a run's turns independent. "
        "Indented: "
        "the stages that changed most.\n",
        100 * (2 * measure::kConfidence - 1));
    for (const auto& [items, file] : {std::pair(&comparison.only_a, "A"), {&comparison.only_b, "B"}})
        for (const std::string& item : *items) fmt::print("only in {}: {}\n", file, item);
    if (comparison.facts.empty()) return;
    fmt::print("\nAlso different:\n");
    const auto shown = [](const std::string& text) { return text.empty() ? "–" : text; };
    for (const measure::Fact& fact : comparison.facts)
        fmt::print("  {}\n    A: {}\n    B: {}\n", fact.what, shown(fact.a), shown(fact.b));
}

}  // namespace

void add_bench_compare_command(CLI::App& bench) {
    struct Options {
        std::filesystem::path a, b;
        bool json = false;
    };
    CLI::App& command = *bench.add_subcommand("compare", "What changed between two results, B over A");
    const auto options = std::make_shared<Options>();
    command.fallthrough(false);  // the options of `clarus bench` are not for this
    command.add_option("A", options->a, "A result of `clarus bench`")->required();
    command.add_option("B", options->b, "Another, of another commit, driver or machine")->required();
    command.add_flag("--json", options->json, "Print JSON");
    command.callback([options] {
        const Comparison comparison = measure::compare(options->a, options->b);
        if (options->json)
            fmt::print("{}\n", json_text(to_json(comparison), 2));
        else
            print(comparison);
    });
}

}  // namespace clarus::cli
