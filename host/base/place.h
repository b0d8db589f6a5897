#pragma once

#include <filesystem>

namespace clarus {

/// `share/clarus` beside the program or shared library that this code is in, in the build tree as where it is
/// installed or was moved to; where there is none, that of the prefix that was configured.
std::filesystem::path data_folder();

}  // namespace clarus
