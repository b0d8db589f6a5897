#pragma once

#include <filesystem>

#include "measure/result.h"

namespace clarus::measure {

/// What a new process does first.
struct FirstFrame {
    std::string device;  // selector
    std::string model;   // name or path
    double scale = 1;    // of a filter
    Size render_size;
    Precision precision = Precision::fp32;
    Tuning tuning = Tuning::stored;
};

/// Runs `tool bench first-frame …` three times, the last of them at three quarters of the render size, with caches that
/// are empty at first: Clarus's own and those of the drivers that let a variable name theirs. What was compiled is then
/// added to this process's cache. Errors: device where the process fails, with the end of what it said.
Start measure_start(const std::filesystem::path& tool, const FirstFrame& first);

/// The other side: upscales a frame. Returns how many programs were compiled.
int show_first_frame(const FirstFrame& first);

/// What the other side prints when it has the frame, before the number of programs.
constexpr const char* kFirstFrameWord = "first frame";

}  // namespace clarus::measure
