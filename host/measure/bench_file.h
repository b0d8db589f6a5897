#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

#include "io/json_reader.h"
#include "measure/statistics.h"

namespace clarus::measure {

/// What `clarus bench` wrote, as bench/schema.json says it: whatever comparisons and reports read is checked, so that
/// neither meets what is not there.
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
