#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "cli/comparison.h"

namespace clarus::cli {

struct SheetColumn {
    std::string label;
    std::filesystem::path file;
};

struct Area {
    int x = 0, y = 0, width = 0, height = 0;  // pixels
};

/// One frame's images side by side, in as many rows as it takes, each with a label above and enlarged parts below.
struct ContactSheet {
    std::filesystem::path file;  // empty where none is wanted
    std::string frame;
    std::vector<Area> crops;
    int column_width = 0;  // the images' where it is 0
    int columns = 0;       // in a row; all of them where it is 0

    void add_to(CLI::App& command);

    /// Errors: invalid_argument where a crop reaches beyond the reference.
    void check(const Reference& reference) const;

    /// Writes the file. The images are shown as the reference, their frame's, is compared. Errors: file, naming an
    /// image that is missing or differs in size.
    void draw(std::span<const SheetColumn> images, const Reference& reference) const;
};

}  // namespace clarus::cli
