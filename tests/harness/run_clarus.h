#pragma once

#include <string>
#include <vector>

#include "program.h"

namespace clarus::test {

/// How a run of the command ended, and what it printed.
struct Outcome {
    int code;
    std::string out, errors;
};

/// Waits for its end, which is not by a signal.
inline Outcome run_clarus(const std::vector<std::string>& arguments) {
    Program program(CLARUS_TOOL, arguments);
    const int code = program.result();
    return {code, program.out(), program.errors()};
}

}  // namespace clarus::test
