#pragma once

#include <span>

namespace clarus::cli {

/// Files of integrations/stream that are embedded in the program.
struct StreamFile {
    const char* name;
    const char* text;
};
std::span<const StreamFile> stream_files();

}  // namespace clarus::cli
