#include "runtime/tuned_table.h"

#include <fmt/format.h>

#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <stdexcept>

#include "base/error.h"
#include "runtime/tuning_file.h"

namespace clarus::runtime {
namespace {

constexpr double kMeasuringError = 0.05;  // of a time

std::string without_sizes(const std::string& problem) {
    static const std::regex magnitude(R"( 2\^[0-9]+)");
    return std::regex_replace(problem, magnitude, "");
}

std::string_view file_of(DeviceClass device_class) {
    switch (device_class) {
        case DeviceClass::gpu:
            return "gpu.json";
        case DeviceClass::cpu:
            return "cpu.json";
        case DeviceClass::dsp:
            return "dsp.json";
    }
    throw std::logic_error("unknown device class");
}

}  // namespace

TunedTable::TunedTable(std::string_view name, std::string_view text) {
    try {
        const nlohmann::json document = nlohmann::json::parse(text);
        const std::set<std::string> known{"implementation", "choices", "seconds", "built_in_seconds"};
        for (const auto& [key, entry] : document.at("results").get_ref<const nlohmann::json::object_t&>()) {
            for (const auto& [field, value] : entry.items())
                if (!known.contains(field)) fail(ErrorKind::file, "{}: \"{}\" in \"{}\" is unknown", name, field, key);
            const size_t problem = key.rfind(", ");  // then which candidates there were
            if (problem == key.npos) fail(ErrorKind::file, "{}: \"{}\" is not a tuner's key", name, key);
            const TuningResult result = read_result(entry, name);
            TuningResult& largest = results_[without_sizes(key.substr(0, problem))];
            if (result.seconds > largest.seconds) largest = result;
        }
    } catch (const nlohmann::json::exception& error) {
        fail(ErrorKind::file, "{} is not a tuning file: {}", name, error.what());
    }
}

std::string TunedTable::key_of(const Problem& problem, const DeviceProfile& profile) {
    return without_sizes(problem_key(problem, profile));
}

std::optional<Selection> TunedTable::find(const Problem& problem, const DeviceProfile& profile) const {
    const auto found = results_.find(key_of(problem, profile));
    if (found == results_.end()) return {};
    const TuningResult& result = found->second;
    if (!(result.seconds < (1 - kMeasuringError) * result.built_in_seconds)) return {};
    return candidate_of(result, problem, profile);
}

const TunedTable* TunedTable::of(DeviceClass device_class) {
    static const std::map<std::string_view, TunedTable> tables = [] {
        std::map<std::string_view, TunedTable> result;
        for (const TunedFile& file : tuned_files()) result.emplace(file.name, TunedTable(file.name, file.text));
        return result;
    }();
    const auto found = tables.find(file_of(device_class));
    return found == tables.end() ? nullptr : &found->second;
}

}  // namespace clarus::runtime
