#pragma once

#include <CLI/CLI.hpp>
#include <map>
#include <string>
#include <vector>

namespace clarus::cli {

/// An option that pipelines declare, as the command line has it.
struct PipelineFlag {
    std::string name;  // PipelineOption::name
    std::string flag;  // --previous-frames
    std::string help;  // for which pipelines, what it does, its range and what it is unless told
};

/// "previous_frames" → "--previous-frames".
std::string flag_of(std::string option);

/// One for each name, in the order of the pipelines.
std::vector<PipelineFlag> pipeline_flags();

/// Adds all of them; those that are given are put into `chosen` (UpscalerOptions::pipeline_options).
void add_pipeline_options(CLI::App& command, std::map<std::string, double>& chosen);

}  // namespace clarus::cli
