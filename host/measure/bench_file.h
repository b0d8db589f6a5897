#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

#include "io/json_reader.h"
#include "measure/statistics.h"

namespace clarus::measure {

/// What `clarus bench` wrote, as bench/schema.json says it: devices and items are checked where comparisons and reports
/// read them.
struct BenchFile {
    std::filesystem::path path;
    nlohmann::json json;

    /// Errors: file.
    explicit BenchFile(const std::filesystem::path& from);
    io::JsonNode root() const { return {json, path}; }
};

/// Errors: file.
Figure read_figure(const io::JsonNode& node);

}  // namespace clarus::measure
