#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "measure/checks.h"
#include "measure/result.h"

namespace clarus::measure {

struct BenchOptions {
    Profile profile = Profile::quick;
    // Empty: as the profile has it.
    std::vector<std::string> devices;  // selectors
    std::vector<std::string> models;   // names or paths
    std::vector<Size> sizes;           // of outputs
    std::vector<Precision> precisions;
    std::optional<double> seconds;  // to spend at most on the turns of one item
    Tuning tuning = Tuning::stored;
    Checks checks;
    /// The tool that is to be started anew to measure starts. Empty: they are not measured.
    std::filesystem::path tool;
    std::string version;
    /// Called with what has been measured so far, now and then: a full run takes hours.
    std::function<void(const BenchResult&)> interim;
};

/// One model at one size and precision on one device.
struct BenchItem {
    Device device;
    Model model;
    Size render_size;
    Precision precision;
};

/// What is to be measured, those to be compared with each other side by side: by size, then by model.
/// Errors: no_device, invalid_argument (options), file (models).
std::vector<BenchItem> bench_items(const BenchOptions& options);

/// Measures them. What cannot be run or shows a wrong image has no score; the rest goes on. Items that fit into a
/// quarter of their device's memory together take turns, each until its spread is small or its time is spent; so do the
/// devices' peaks. `progress` is called with 0…1.
BenchResult run_bench(const BenchOptions& options, const std::vector<BenchItem>& items,
                      const std::function<void(double)>& progress);

/// What the item must show, in fp32: added to `checks` unless it is there already. Whether it was not. From the obvious
/// kernels, but for networks so large that these take hours: others are tested against them, too.
/// Errors: those of Upscaler.
bool add_check(Checks& checks, const BenchItem& item, Tuning tuning = Tuning::obvious);

}  // namespace clarus::measure
