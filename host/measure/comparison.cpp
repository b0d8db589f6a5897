#include "measure/comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>

#include "io/json_reader.h"
#include "measure/bench_file.h"

namespace clarus::measure {
namespace {

using io::JsonNode;

Change change(const JsonNode& a, const JsonNode& b) { return {read_figure(a), read_figure(b)}; }

/// What stands there as text; "" where nothing does.
std::string text_at(const nlohmann::json& json, const std::string& pointer) {
    const nlohmann::json::json_pointer place(pointer);
    if (!json.contains(place) || json.at(place).is_null()) return {};
    const nlohmann::json& value = json.at(place);
    return value.is_string() ? value.get<std::string>() : value.dump();
}

void add_fact(std::vector<Fact>& facts, std::string what, std::string a, std::string b) {
    const auto is_new = [&](const Fact& fact) { return fact.what != what || fact.a != a || fact.b != b; };
    if (a != b && std::all_of(facts.begin(), facts.end(), is_new))
        facts.push_back({std::move(what), std::move(a), std::move(b)});
}

/// Facts of the same keys in two objects; `of` stands before their names.
void add_facts(std::vector<Fact>& facts, const std::string& of, const nlohmann::json& a, const nlohmann::json& b,
               std::initializer_list<std::pair<const char*, const char*>> names_and_pointers) {
    for (const auto& [name, pointer] : names_and_pointers)
        add_fact(facts, of + name, text_at(a, pointer), text_at(b, pointer));
}

using Pairs = std::vector<std::pair<size_t, size_t>>;

Pairs paired_devices(const nlohmann::json& a, const nlohmann::json& b) {
    Pairs pairs;
    std::vector<size_t> left_a(a.size()), left_b(b.size());
    for (size_t i = 0; i < a.size(); ++i) left_a[i] = i;
    for (size_t i = 0; i < b.size(); ++i) left_b[i] = i;
    const auto pair = [&](auto&& belong_together) {
        for (auto one = left_a.begin(); one != left_a.end();) {
            const auto other =
                std::find_if(left_b.begin(), left_b.end(), [&](size_t i) { return belong_together(a[*one], b[i]); });
            if (other == left_b.end()) {
                ++one;
                continue;
            }
            pairs.emplace_back(*one, *other);
            left_b.erase(other);
            one = left_a.erase(one);
        }
    };
    const auto same = [](const nlohmann::json& one, const nlohmann::json& other, const char* key) {
        const std::string pointer = std::string("/profile/") + key;
        return text_at(one, pointer) == text_at(other, pointer);
    };
    const auto same_name = [&](const auto& one, const auto& other) {
        return same(one, other, "name") && same(one, other, "platform");
    };
    pair([&](const auto& one, const auto& other) { return same_name(one, other) && same(one, other, "selector"); });
    pair(same_name);
    pair([](const auto&, const auto&) { return true; });
    std::sort(pairs.begin(), pairs.end());
    return pairs;
}

struct ItemKey {
    size_t pair;  // of devices
    std::string model;
    int width, height;
    std::string precision;
    auto operator<=>(const ItemKey&) const = default;
};

class Comparer {
  public:
    Comparer(const BenchFile& a, const BenchFile& b) : a_(a), b_(b) {
        const auto devices_a = a.root()["devices"].items(), devices_b = b.root()["devices"].items();
        pairs_ = paired_devices(a.json["devices"], b.json["devices"]);
        add_facts(result_.facts, "", a.json, b.json,
                  {{"Clarus", "/suite/version"},
                   {"commit", "/suite/commit"},
                   {"profile", "/suite/profile"},
                   {"tuning", "/suite/tuning"},
                   {"processor", "/host/cpu"},
                   {"cores", "/host/cores"},
                   {"main memory", "/host/memory"},
                   {"system", "/host/os"},
                   {"kernel of the system", "/host/kernel"},
                   {"governor", "/host/governor"}});
        for (const auto& [i, j] : pairs_)
            compare_devices(devices_a[i], devices_b[j], a.json["devices"][i], b.json["devices"][j]);
        compare_items();
    }

    Comparison result() && { return std::move(result_); }

  private:
    void compare_devices(const JsonNode& a, const JsonNode& b, const nlohmann::json& json_a,
                         const nlohmann::json& json_b) {
        result_.devices.push_back({a["profile"]["name"].text(), b["profile"]["name"].text(),
                                   change(a["compute_peak"], b["compute_peak"]),
                                   change(a["copy_bandwidth"], b["copy_bandwidth"])});
        const std::string of = result_.devices.back().a + ": ";
        add_facts(result_.facts, of, json_a, json_b,
                  {{"name", "/profile/name"},
                   {"platform", "/profile/platform"},
                   {"driver", "/profile/driver_version"},
                   {"OpenCL", "/profile/opencl_version"},
                   {"OpenCL C", "/opencl_c_version"},
                   {"compiler", "/platform_version"},
                   {"compute units", "/profile/compute_units"},
                   {"clock, MHz", "/profile/clock_mhz"}});
    }

    /// Items by what they have in common with the other file's; in the file's order.
    std::vector<std::pair<ItemKey, JsonNode>> items(const BenchFile& file, bool is_a) const {
        std::vector<std::pair<ItemKey, JsonNode>> result;
        const auto devices = file.root()["devices"].items();
        for (const JsonNode& item : file.root()["items"].items()) {
            const std::string selector = item["device"].text();
            const auto pair = std::find_if(pairs_.begin(), pairs_.end(), [&](const auto& each) {
                return devices[is_a ? each.first : each.second]["profile"]["selector"].text() == selector;
            });
            const auto size = item["output_size"].items(2);
            // One whose device the other file lacks has a number that is no pair's.
            result.emplace_back(
                ItemKey{pair == pairs_.end() && !is_a ? pairs_.size() + 1 : static_cast<size_t>(pair - pairs_.begin()),
                        item["model"]["name"].text(), static_cast<int>(size[0].integer(1, 1 << 15)),
                        static_cast<int>(size[1].integer(1, 1 << 15)), item["precision"].text()},
                item);
        }
        return result;
    }

    void compare_items() {
        const auto items_a = items(a_, true), items_b = items(b_, false);
        std::map<ItemKey, const JsonNode*> of_b;
        for (const auto& [key, item] : items_b) of_b[key] = &item;
        for (const auto& [key, item] : items_a) {
            const auto other = of_b.find(key);
            if (other == of_b.end()) {
                result_.only_a.push_back(text_of(a_, key, item));
                continue;
            }
            compare_item(key, item, *other->second);
            of_b.erase(other);
        }
        for (const auto& [key, item] : items_b)
            if (of_b.contains(key)) result_.only_b.push_back(text_of(b_, key, item));
    }

    /// As facts name an item: its device is said where one of the files has several.
    std::string text_of(const BenchFile& file, const ItemKey& key, const JsonNode& item) const {
        std::string device;
        if (std::max(a_.json["devices"].size(), b_.json["devices"].size()) > 1) {
            const std::string selector = item["device"].text();
            for (const JsonNode& each : file.root()["devices"].items())
                if (each["profile"]["selector"].text() == selector)
                    device = fmt::format("{} ({}): ", each["profile"]["name"].text(), selector);
        }
        return fmt::format("{}{} {}x{} {}", device, key.model, key.width, key.height, key.precision);
    }

    void compare_item(const ItemKey& key, const JsonNode& a, const JsonNode& b) {
        ItemChange item{key.pair, key.model, key.precision, {key.width, key.height}, {}, {}, {}, {}};
        const auto word = [](const JsonNode& node) { return node.is_null() ? std::string() : node.text(); };
        add_fact(result_.facts, key.model + ": weights", word(a["model"]["checksum"]), word(b["model"]["checksum"]));
        const JsonNode score_a = a["score"], score_b = b["score"];
        if (score_a.is_null() || score_b.is_null()) {
            const char* side = score_b.is_null() ? "B" : "A";
            item.no_score = fmt::format("{}: {}", side, word((score_b.is_null() ? b : a)["no_score"]));
        } else {
            item.latency = change(score_a["latency"], score_b["latency"]);
            item.frames_per_second = change(score_a["frames_per_second"], score_b["frames_per_second"]);
            compare_stages(text_of(a_, key, a), score_a, score_b, item.stages);
        }
        result_.items.push_back(std::move(item));
    }

    void compare_stages(const std::string& item, const JsonNode& a, const JsonNode& b,
                        std::vector<StageChange>& changes) {
        std::map<std::string, JsonNode> of_b;
        for (const JsonNode& stage : b["stages"].items()) of_b.emplace(stage["name"].text(), stage);
        const auto add_kernels = [&](const std::string& stage, const std::string& one, const std::string& other) {
            add_fact(result_.facts, fmt::format("{}: kernel of {}", item, stage), one, other);
        };
        for (const JsonNode& stage : a["stages"].items()) {
            const std::string name = stage["name"].text(), kernel = stage["kernel"].text();
            const auto other = of_b.find(name);
            add_kernels(name, kernel, other == of_b.end() ? "" : other->second["kernel"].text());
            if (other == of_b.end()) continue;
            changes.push_back({name, change(stage["seconds"], other->second["seconds"])});
            of_b.erase(other);
        }
        for (const auto& [name, stage] : of_b) add_kernels(name, "", stage["kernel"].text());
    }

    const BenchFile &a_, &b_;
    Pairs pairs_;
    Comparison result_;
};

}  // namespace

Comparison compare(const std::filesystem::path& a, const std::filesystem::path& b) {
    const BenchFile file_a(a), file_b(b);
    return Comparer(file_a, file_b).result();
}

}  // namespace clarus::measure
