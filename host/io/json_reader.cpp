#include "io/json_reader.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <limits>
#include <set>

#include "base/error.h"
#include "base/nearest.h"
#include "io/file.h"

namespace clarus::io {
namespace {

// What is read is also copied and printed, by recursion; and each value takes many times the bytes of its text.
constexpr int kDeepest = 64;
constexpr size_t kLongestList = size_t{1} << 20;
constexpr size_t kMostValues = size_t{1} << 24;

std::string shortened(const nlohmann::json& value) {
    constexpr size_t longest = 40;
    if (value.is_object()) return "an object";
    if (value.is_array()) return "a list of " + std::to_string(value.size());
    std::string text = value.dump(-1, ' ', true);
    if (text.size() > longest) text = text.substr(0, longest) + "…";
    return text;
}

}  // namespace

nlohmann::json parse_json(std::string_view text, const std::filesystem::path& file) {
    using json = nlohmann::json;
    if (const size_t nul = text.find('\0'); nul != text.npos)  // which would end it for nlohmann
        fail(ErrorKind::file, "{} is not valid JSON: byte {} is NUL", file.string(), nul);
    std::vector<std::set<std::string>> keys;  // of every object that is open
    size_t values = 0;
    const auto check = [&](int depth, json::parse_event_t event, json& value) {
        if (depth > kDeepest) fail(ErrorKind::file, "{}: values nest more than {} deep", file.string(), kDeepest);
        if (++values > kMostValues) fail(ErrorKind::file, "{} holds more than {} values", file.string(), kMostValues);
        if (event == json::parse_event_t::object_start) keys.emplace_back();
        if (event == json::parse_event_t::object_end) keys.pop_back();
        if (event == json::parse_event_t::key && !keys.back().insert(value.get<std::string>()).second)
            fail(ErrorKind::file, "{}: the key {} stands twice in one object", file.string(), shortened(value));
        return true;
    };
    try {
        return json::parse(text, check);
    } catch (const json::exception& error) {
        const std::string message = error.what();  // "[json.exception.…] what is wrong"
        fail(ErrorKind::file, "{} is not valid JSON: {}", file.string(), message.substr(message.find("] ") + 2));
    }
}

nlohmann::json read_json(const std::filesystem::path& file) { return parse_json(read_file(file, largest_json), file); }

std::optional<nlohmann::json> try_parse_json(std::string_view text) {
    try {
        return parse_json(text, {});
    } catch (const Error&) {
        return std::nullopt;
    }
}

JsonNode JsonNode::operator[](const std::string& key) const {
    if (const auto member = find(key)) return *member;
    const std::string_view name = key;
    std::string misspelt;
    for (const auto& [present, value] : value_->items())
        if (misspelt.empty() && !nearest(present, std::span(&name, 1)).empty())
            misspelt = fmt::format("; it has {}", shortened(present));
    fail(ErrorKind::file, "{}: {} lacks the field \"{}\"{}", file_->string(), place_.empty() ? "the top level" : place_,
         key, misspelt);
}

std::optional<JsonNode> JsonNode::find(const std::string& key) const {
    if (!value_->is_object()) refuse("an object");
    const auto member = value_->find(key);
    if (member == value_->end()) return std::nullopt;
    return JsonNode(*member, *file_, place_.empty() ? key : place_ + "." + key);
}

std::vector<std::pair<std::string, JsonNode>> JsonNode::members() const {
    if (!value_->is_object()) refuse("an object");
    std::vector<std::pair<std::string, JsonNode>> result;
    for (const auto& [key, unused] : value_->items()) result.emplace_back(key, (*this)[key]);
    return result;
}

void JsonNode::allow_members(std::span<const std::string_view> names) const { check_members(names, true); }

void JsonNode::refuse_misspelt(std::span<const std::string_view> names) const { check_members(names, false); }

void JsonNode::check_members(std::span<const std::string_view> names, bool are_all) const {
    for (const auto& [key, node] : members()) {
        if (std::ranges::find(names, key) != names.end()) continue;
        const std::string_view meant = nearest(key, names);
        if (meant.empty() && !are_all) continue;
        fail(ErrorKind::file, "{}: {} has the unknown field {}; {}", file_->string(),
             place_.empty() ? "the top level" : place_, shortened(key),
             meant.empty() ? fmt::format("there are {}", fmt::join(names, ", ")) : fmt::format("is it {}?", meant));
    }
}

std::vector<JsonNode> JsonNode::items() const {
    if (!value_->is_array()) refuse("a list");
    if (value_->size() > kLongestList) refuse(fmt::format("a list of at most {}", kLongestList));
    std::vector<JsonNode> result;
    for (size_t i = 0; i < value_->size(); ++i)
        result.emplace_back((*value_)[i], *file_, place_ + "[" + std::to_string(i) + "]");
    return result;
}

std::vector<JsonNode> JsonNode::items(size_t count) const {
    if (!value_->is_array() || value_->size() != count) refuse("a list of " + std::to_string(count));
    return items();
}

bool JsonNode::boolean() const {
    if (!value_->is_boolean()) refuse("true or false");
    return value_->get<bool>();
}

std::string JsonNode::text() const {
    if (!value_->is_string()) refuse("a string");
    return value_->get<std::string>();
}

int64_t JsonNode::integer(int64_t low, int64_t high) const {
    const bool fits = value_->is_number_integer() &&
                      (!value_->is_number_unsigned() || std::in_range<int64_t>(value_->get<uint64_t>()));
    if (!fits || value_->get<int64_t>() < low || value_->get<int64_t>() > high)
        refuse(low == high ? fmt::format("{}", low) : fmt::format("a whole number from {} to {}", low, high));
    return value_->get<int64_t>();
}

double JsonNode::number(double low, double high) const {
    if (!value_->is_number() || value_->get<double>() < low || value_->get<double>() > high)
        refuse(fmt::format("a number from {} to {}", low, high));
    return value_->get<double>();
}

float JsonNode::positive() const {
    using limits = std::numeric_limits<float>;
    if (!value_->is_number() || value_->get<double>() < limits::min() || value_->get<double>() > limits::max())
        refuse("a positive number");
    return value_->get<float>();
}

void JsonNode::refuse(std::string_view expected, std::string_view remark) const {
    fail(ErrorKind::file, "{}: {} must be {}, not {}{}", file_->string(), place_.empty() ? "the top level" : place_,
         expected, shortened(*value_), remark);
}

}  // namespace clarus::io
