#pragma once

#include <CLI/Validators.hpp>
#include <string>

namespace clarus::cli {

/// Of an option that takes a number: neither "nan", which CLI11's ranges let through, nor "inf".
inline CLI::Validator finite() {
    return CLI::Validator(
        [](const std::string& text) { return text.find('n') == text.npos ? "" : "not a finite number"; }, "");
}

}  // namespace clarus::cli
