#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "check/check.h"

namespace clarus::cli {

/// The JSON that `clarus check --fix` writes for a sequence: NAME.fixed.json beside NAME.json.
std::filesystem::path corrected_name(const std::filesystem::path& sequence);

/// Refuses, before any work, what could not be written. Errors: invalid_argument where the sequence has no
/// sequence.json; file where `corrected` is there already.
void require_correctable(const std::filesystem::path& sequence, const std::filesystem::path& corrected);

/// Writes the sequence's JSON with what is wrong put right; `first` is the place of the first frame that was checked.
/// What a JSON cannot say is left, and is said. Returns lines for the user. Errors: file.
std::vector<std::string> write_correction(const std::filesystem::path& sequence, const std::filesystem::path& corrected,
                                          const check::Correction& correction, size_t first);

}  // namespace clarus::cli
