#include <doctest/doctest.h>

#include <string>
#include <vector>

#include "report/base64.h"
#include "report/page.h"

using clarus::report::page;

namespace {

size_t count(const std::string& text, const std::string& part) {
    size_t found = 0;
    for (size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++found;
    return found;
}

}  // namespace

TEST_CASE("the report's data cannot leave its element, and is what was given") {
    const nlohmann::ordered_json data{{"title", "</script><!--<script>\"&'\\ é {{page.js}}"},
                                      {"frames", {"0000", 1.5}}};
    const std::string text = page(data);
    CHECK(count(text, "<script") == 2);
    CHECK(count(text, "</script>") == 2);
    const std::string begin = "<script type=\"application/json\" id=\"data\">";
    const size_t first = text.find(begin) + begin.size();
    CHECK(nlohmann::ordered_json::parse(text.substr(first, text.find("</script>", first) - first)) == data);
}

TEST_CASE("the report is one file") {
    const std::string text = page({{"results", nlohmann::ordered_json::array()}});
    for (const char* part : {" src=", "<link", "@import", "url(", "fetch("})
        CHECK_MESSAGE(count(text, part) == 0, part);
    CHECK(count(text, "{{") == 0);
}

TEST_CASE("a page that is served asks its server, and nobody else") {
    const std::string text = page({{"results", nlohmann::ordered_json::array()}, {"version", "1"}});
    CHECK(count(text, "connect-src 'self'") == 1);
    CHECK(count(text, "fetch('version'") == 1);
    CHECK(count(text, "{{") == 0);
}

TEST_CASE("the report takes names that are not UTF-8") {
    CHECK(count(page({{"title", "a\xff"}}), "a\xEF\xBF\xBD") == 1);
}

TEST_CASE("base64 is RFC 4648's, for every remainder") {
    const auto encoded = [](const std::string& text) {
        return clarus::report::base64(std::vector<unsigned char>(text.begin(), text.end()));
    };
    CHECK(encoded("") == "");
    CHECK(encoded("f") == "Zg==");
    CHECK(encoded("fo") == "Zm8=");
    CHECK(encoded("foo") == "Zm9v");
    CHECK(encoded("foob") == "Zm9vYg==");
    CHECK(encoded("\xff\xff\xfe") == "///+");
}
