# Writes what `git describe` says of SOURCE to FILE as a C++ header, where it has changed; "" outside of git.
execute_process(COMMAND git -C ${SOURCE} describe --always --dirty OUTPUT_VARIABLE commit
                OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
file(CONFIGURE OUTPUT ${FILE} CONTENT "#pragma once\n\nnamespace clarus::measure {\n\nconstexpr const char* kCommit = \"${commit}\";\n\n}  // namespace clarus::measure\n")
