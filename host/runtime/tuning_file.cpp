#include "runtime/tuning_file.h"

#include <nlohmann/json.hpp>
#include <utility>

#include "base/error.h"

namespace clarus::runtime {

using nlohmann::json;

TuningResult read_result(const json& entry, std::string_view file) {
    TuningResult result{entry.at("implementation"), {}, entry.at("seconds"), entry.value("built_in_seconds", 0.0)};
    for (const auto& [name, value] : entry.at("choices").get_ref<const json::object_t&>()) {
        // nlohmann would make an int of any number.
        const bool fits = value.is_number_unsigned()
                              ? std::in_range<int>(value.get<uint64_t>())
                              : value.is_number_integer() && std::in_range<int>(value.get<int64_t>());
        if (!fits) fail(ErrorKind::file, "{}: the choice of \"{}\" is {}, which is no int", file, name, value.dump());
        result.choices[name] = value;
    }
    return result;
}

TuningResults read_results(std::string_view text, std::string_view file) {
    const auto leave_out_deeper = [](int depth, json::parse_event_t, const json&) { return depth <= 4; };
    try {
        TuningResults results;
        const json document = json::parse(text, leave_out_deeper);
        for (const auto& [key, entry] : document.at("results").get_ref<const json::object_t&>())
            results[key] = read_result(entry, file);
        return results;
    } catch (const json::exception& error) {
        fail(ErrorKind::file, "{} is not a tuning file: {}", file, error.what());
    }
}

}  // namespace clarus::runtime
