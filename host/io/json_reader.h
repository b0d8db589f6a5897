#pragma once

#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace clarus::io {

/// Parses a whole text; an object that has a key twice is refused, as are values that nest more than 64 deep and more
/// than 2^24 of them. `file` is for the message. Errors: file.
nlohmann::json parse_json(std::string_view text, const std::filesystem::path& file);

inline constexpr uintmax_t largest_json = uintmax_t{256} << 20;  // bytes

/// Of a file of at most so many bytes. Errors: file.
nlohmann::json read_json(const std::filesystem::path& file);

/// The same of a text that may be something else: none for what parse_json refuses.
std::optional<nlohmann::json> try_parse_json(std::string_view text);

/// A JSON value that knows its file and its place in it ("frames[3].jitter"), so that every complaint names both.
/// Each reading function has the error file for a value of another type. Refers to value and file; keeps neither.
class JsonNode {
  public:
    JsonNode(const nlohmann::json& value, const std::filesystem::path& file, std::string place = {})
        : value_(&value), file_(&file), place_(std::move(place)) {}

    JsonNode operator[](const std::string& key) const;  // a member that must be there
    std::optional<JsonNode> find(const std::string& key) const;
    std::vector<std::pair<std::string, JsonNode>> members() const;
    /// Errors: file, for a member that is none of these; suggests the nearest of them, or lists them.
    void allow_members(std::span<const std::string_view> names) const;
    /// Of a form that others define, which may have more members: refuses what may be one of these names, misspelt.
    void refuse_misspelt(std::span<const std::string_view> names) const;
    std::vector<JsonNode> items() const;
    std::vector<JsonNode> items(size_t count) const;

    size_t size() const { return value_->size(); }  // of a list or an object
    bool is_null() const { return value_->is_null(); }
    bool boolean() const;
    std::string text() const;
    int64_t integer(int64_t low, int64_t high) const;
    double number(double low, double high) const;
    float positive() const;  // that is so as a float, too

    /// One of the words, as what stands beside it.
    template <typename T>
    T choice(std::initializer_list<std::pair<const char*, T>> words) const {
        std::string allowed;
        for (const auto& [word, meaning] : words) {
            // nlohmann's own comparison makes a value of the word, and ends the process where memory does.
            if (value_->is_string() && value_->get_ref<const std::string&>() == word) return meaning;
            allowed += allowed.empty() ? "\"" : ", \"";
            allowed += word;
            allowed += '"';
        }
        refuse((words.size() > 1 ? "one of " : "") + allowed);
    }

    /// Throws: this value must be what `expected` says. `remark` follows what it is, for a reason or a way out.
    [[noreturn]] void refuse(std::string_view expected, std::string_view remark = {}) const;

  private:
    /// `are_all`: other members are refused, too, and not only what is nearly one of these.
    void check_members(std::span<const std::string_view> names, bool are_all) const;

    const nlohmann::json* value_;
    const std::filesystem::path* file_;
    std::string place_;
};

}  // namespace clarus::io
