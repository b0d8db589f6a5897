#pragma once

#include <filesystem>
#include <string>

#include "check/check.h"

namespace clarus::cli {

/// What `clarus check --report` writes: the table; of some frames the one before it as it is warped by what is declared
/// and by what fits best, beside the frame itself, and its vectors; and the jitter's changes, measured against the
/// JSON's. Reads the frames that it shows once more. Errors: those of io::read_frame.
std::string check_page(const check::Film& film, const check::Evidence& evidence, const check::Judgement& judgement,
                       const std::filesystem::path& sequence);

}  // namespace clarus::cli
