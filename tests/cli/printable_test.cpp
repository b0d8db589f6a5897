#include "cli/printable.h"

#include <doctest/doctest.h>

using clarus::cli::printable;

TEST_CASE("nothing that a terminal obeys is printed") {
    CHECK(printable("name.png\n\tünïcödé – 日本語 🙂") == "name.png\n\tünïcödé – 日本語 🙂");
    CHECK(printable("\033[1mbold\033[0m") == "\033[1mbold\033[0m");
    CHECK(printable("\033]0;title\a\033[31mred\r\b\x7f") == "\\x1b]0;title\\x07\\x1b[31mred\\x0d\\x08\\x7f");
    CHECK(printable("\xc2\x9b"
                    "31m") == "\\xc2\\x9b31m");
    CHECK(printable("\x9b"
                    "31m \xff \xe6\x97") == "\\x9b31m \\xff \\xe6\\x97");
    CHECK(printable("") == "");
}
