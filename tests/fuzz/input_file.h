#pragma once

#include <cstddef>
#include <cstdint>
#include <fstream>

#include "temporary_folder.h"

/// The input as a file in a folder of its own, which stays as long as the program runs: readers take paths.
inline std::filesystem::path input_file(const char* name, const uint8_t* data, size_t size) {
    static const TemporaryFolder folder;
    const std::filesystem::path path = folder / name;
    std::ofstream(path, std::ios::binary)
        .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
    return path;
}
