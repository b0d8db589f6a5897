#pragma once

#include <string>
#include <string_view>

namespace clarus::ocl {

/// The text of a file of `kernels/`, such as "warp.cl". Errors: invalid_argument where there is no such file.
std::string_view kernel_file(std::string_view name);

/// `source` with common.clh before it, and what it includes put in. The compiler's messages call it `name`.
std::string with_common(std::string_view name, std::string_view source);

}  // namespace clarus::ocl
