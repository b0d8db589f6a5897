#include "base/module.h"

#include <doctest/doctest.h>

#include "clarus/error.h"

using namespace clarus;
using doctest::Contains;

TEST_CASE("a module that is not there, or lacks the function, is named") {
    CHECK_THROWS_WITH_AS(find_module_function("clarus_none", "anything"), Contains("clarus_none.so"), Error);
    CHECK_THROWS_WITH_AS(find_module_function("clarus_images", "no_such_function"), Contains("no_such_function"),
                         Error);
    CHECK(find_module_function("clarus_images", "clarus_images") != nullptr);
}
