#include <doctest/doctest.h>

#include <cstddef>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/error.h"
#include "io/json_reader.h"

using namespace clarus;

using doctest::Contains;

TEST_CASE("JSON that would take the memory is refused before it does") {
    std::string ones = "[";
    for (size_t i = 0; i < (size_t{1} << 24); ++i) ones += "1,";
    CHECK_THROWS_WITH_AS(io::parse_json(ones + "1]", "many.json"),
                         Contains("many.json holds more than 16777216 values"), Error);
    const nlohmann::json list(std::vector<int>((size_t{1} << 20) + 1, 1));
    CHECK_THROWS_WITH_AS(io::JsonNode(list, "many.json").items(), Contains("a list of at most 1048576"), Error);
}

TEST_SUITE("small") {
    TEST_CASE("what may be JSON is none where it is not, nests without end, or says a key twice") {
        CHECK((*io::try_parse_json(R"({"frames": [1]})"))["frames"][0] == 1);
        CHECK_FALSE(io::try_parse_json("{"));
        CHECK_FALSE(io::try_parse_json(""));
        CHECK_FALSE(io::try_parse_json(std::string(200'000, '[')));
        CHECK_FALSE(io::try_parse_json(std::string(100, '[') + std::string(100, ']')));
        CHECK_FALSE(io::try_parse_json(R"({"a": 1, "a": 2})"));
    }
}
