#pragma once

#include <string>
#include <string_view>

namespace clarus::cli {

/// Text with its control characters as escapes, "\x1b", but for line breaks, tabs, and the sequences for bold letters:
/// names of files and devices and what files say of themselves may hold what a terminal would obey. What is no UTF-8 is
/// escaped, too, where it could be a control character.
std::string printable(std::string_view text);

/// From here on what is printed to a terminal as standard output is printable.
void guard_terminal();

}  // namespace clarus::cli
