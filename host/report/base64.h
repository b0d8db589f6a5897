#pragma once

#include <span>
#include <string>

namespace clarus::report {

/// RFC 4648's base64, padded, on one line.
std::string base64(std::span<const unsigned char> bytes);

}  // namespace clarus::report
