#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

namespace clarus::cli {

/// Where `clarus upscale --report` leaves what a run into this folder did and took.
std::filesystem::path run_file(const std::filesystem::path& folder);

/// That of a result's folder, all that the page reads checked; null where there is none. Errors: file, by field.
nlohmann::ordered_json read_run(const std::filesystem::path& folder);

}  // namespace clarus::cli
