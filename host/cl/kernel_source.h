#pragma once

#include <span>
#include <string>
#include <string_view>

namespace clarus::ocl {

/// The text of a file of `kernels/`, such as "warp.cl". Errors: invalid_argument where there is no such file.
std::string_view kernel_file(std::string_view name);

/// A kernel file, or source made at run time, as it is to be compiled for some options.
struct ProgramUnit {
    std::string_view name;  // "warp.cl", or what the compiler's messages call the source
    std::string_view source;
    std::string_view options;  // "-DSTRIP=64 -DSTORE_HALF"; values without spaces, and nothing but -D
};

/// The text of one program of all units, common.clh before them. Files may define the same names, and the same file may
/// be there for several options: what unit k > 0 defines outside of functions ends in _k (of a name that a macro
/// pastes together, the part before), and its macros end with it.
std::string program_text(std::span<const ProgramUnit> units);

/// What unit k calls its kernel `name`.
std::string name_in_unit(std::string_view name, size_t unit);

}  // namespace clarus::ocl
