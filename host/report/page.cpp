#include "report/page.h"

#include <algorithm>
#include <stdexcept>
#include <string_view>

#include "base/json_text.h"
#include "report/page_files.h"

namespace clarus::report {
namespace {

std::string_view file(std::string_view name) {
    const auto files = page_files();
    const auto found = std::ranges::find(files, name, &PageFile::name);
    if (found == files.end()) throw std::logic_error("the page has no such file");
    return found->text;
}

/// JSON that cannot end the element it stands in, whatever its strings hold.
std::string script_safe(const nlohmann::ordered_json& data) {
    const std::string json = json_text(data);
    std::string text;
    text.reserve(json.size());
    for (const char character : json) {
        if (character == '<')
            text += "\\u003c";
        else
            text += character;
    }
    return text;
}

/// A page that is served may ask where it is from; one that is a file asks nothing.
std::string part_of_page(std::string_view part, const nlohmann::ordered_json& data) {
    const bool is_served = data.contains("version");
    if (part == "data") return script_safe(data);
    if (part == "policy") return is_served ? "; connect-src 'self'" : "";
    if (part == "live") return is_served ? std::string(file("live.js")) : "";
    return std::string(file(part));
}

}  // namespace

std::string page(const nlohmann::ordered_json& data, std::string_view name) {
    std::string text;
    std::string_view rest = file(name);
    for (size_t open = rest.find("{{"); open != std::string_view::npos; open = rest.find("{{")) {
        const size_t close = rest.find("}}", open);
        const std::string_view part = rest.substr(open + 2, close - open - 2);
        text += rest.substr(0, open);
        text += part_of_page(part, data);
        rest.remove_prefix(close + 2);
    }
    return text.append(rest);
}

}  // namespace clarus::report
