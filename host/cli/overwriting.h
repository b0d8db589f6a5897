#pragma once

#include <filesystem>

#include "clarus/upscaler.h"
#include "cli/frame_loop.h"
#include "cli/taken_files.h"
#include "io/sequence.h"

namespace clarus::cli {

/// Refuses what would replace something that the run reads or also writes, or lie among the sequence's own files, of
/// which --frames may have left some out. `sequence_path` as it was given; `report` and `trace` empty where they are
/// not written. Errors: invalid_argument, naming the option.
void refuse_overwriting_inputs(const std::filesystem::path& sequence_path, const io::Sequence& sequence,
                               const Model& model, const FrameOutput& output, const std::filesystem::path& report,
                               const std::filesystem::path& trace);

}  // namespace clarus::cli
