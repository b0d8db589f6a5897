#include <doctest/doctest.h>

#include "io/json_reader.h"

using namespace clarus;

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
