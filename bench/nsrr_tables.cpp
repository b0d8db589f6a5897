#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include "base/error.h"
#include "bench/random_model.h"
#include "bench/suite.h"
#include "measure/statistics.h"

// The runtimes of Xiao et al. 2020, on this device.
namespace clarus::bench {
namespace {

constexpr int kScale = 4, kFull = 32, kFast = 16, kPreviousFrames = 4;
constexpr int kFrames = 3;  // a 4K frame takes seconds
constexpr Size k1080p{1920, 1080};

struct Measured {
    double seconds = 0;  // median
    std::vector<StageProfile> stages;
    MemoryRequirements memory;

    /// Time of the layers' operations at the device's peak.
    double dense_seconds(double peak) const {
        double operations = 0;
        for (const StageProfile& stage : stages)
            if (is_convolution(stage)) operations += stage.operations;
        return operations / peak;
    }
};

Measured measure(const Device& device, int width, Size output, int previous_frames = kPreviousFrames) {
    measure::DeviceSequences sequences;
    FrameBench frame(device, "NSRR", random_nsrr(kScale, previous_frames, width),
                     {output.width / kScale, output.height / kScale}, sequences);
    frame.run();
    frame.stages();  // of a frame that wakes threads and fills caches
    std::vector<double> seconds;
    for (int run = 0; run < kFrames; ++run) seconds.push_back(frame.run());
    return {measure::median(seconds), frame.stages(), frame.memory()};
}

/// Prints a part of a row at once: what is left of it, and the next row, may take a minute to measure.
template <typename... Arguments>
void show(fmt::format_string<Arguments...> format, Arguments&&... arguments) {
    fmt::print(format, std::forward<Arguments>(arguments)...);
    std::fflush(stdout);
}

double mebibytes(size_t bytes) { return static_cast<double>(bytes) / (1 << 20); }

void print_sizes(const Device& device, double peak) {
    fmt::print("{:<12}{:<12}{:>10}{:>16}{:>8}{:>12}\n", "network", "output", "ms", "dense at peak", "ratio",
               "memory MiB");
    for (const auto& [name, width] : {std::pair{"NSRR", kFull}, {"NSRR-fast", kFast}}) {
        for (const Size size : {Size{1280, 720}, {1080, 1200}, k1080p, {3840, 2160}}) {
            show("{:<12}{:<12}", name, fmt::format("{}x{}", size.width, size.height));
            const Measured measured = measure(device, width, size);
            const double dense = measured.dense_seconds(peak);
            show("{:>10.1f}{:>16.1f}{:>8.2f}{:>12.0f}\n", 1e3 * measured.seconds, 1e3 * dense, measured.seconds / dense,
                 mebibytes(measured.memory.total()));
        }
    }
}

void print_stages(const Device& device) {
    // The paper's names, and how the names of their stages begin.
    const std::vector<std::pair<std::string, std::vector<std::string>>> modules = {
        {"Feature extraction", {"colour conversion", "features", "copy"}},
        {"Motion vector upsampling", {"motion upsampling"}},
        {"Warping", {"warp"}},
        {"Feature reweighting", {"reweight"}},
        {"Reconstruction", {"unet", "output"}},
        {"Reading and writing images", {"ingest", "present"}},
    };
    const Measured full = measure(device, kFull, k1080p), fast = measure(device, kFast, k1080p);
    const auto sum = [](const Measured& measured, const std::vector<std::string>& prefixes) {
        double seconds = 0;
        for (const StageProfile& stage : measured.stages)
            if (std::any_of(prefixes.begin(), prefixes.end(),
                            [&](const std::string& prefix) { return stage.name.starts_with(prefix); }))
                seconds += stage.seconds;
        return seconds;
    };
    fmt::print("{:<30}{:>10}{:>12}\n", "module", "NSRR ms", "NSRR-fast");
    for (const auto& [name, prefixes] : modules)
        fmt::print("{:<30}{:>10.1f}{:>12.1f}\n", name, 1e3 * sum(full, prefixes), 1e3 * sum(fast, prefixes));
    const auto other = [&](const Measured& measured) {
        double seconds = 0;
        for (const StageProfile& stage : measured.stages) seconds += stage.seconds;
        for (const auto& [name, prefixes] : modules) seconds -= sum(measured, prefixes);
        return seconds;
    };
    fmt::print("{:<30}{:>10.1f}{:>12.1f}\n", "Stages of no module", 1e3 * other(full), 1e3 * other(fast));
    fmt::print("{:<30}{:>10.1f}{:>12.1f}\n", "Total", 1e3 * full.seconds, 1e3 * fast.seconds);
    fmt::print("Zero-upsampling is part of whoever reads its result: the zeros are never stored.\n");
}

void print_previous_frames(const Device& device) {
    fmt::print("{:<18}{:>10}\n", "previous frames", "ms");
    for (int n = 0; n <= kPreviousFrames; ++n) {
        show("{:<18}", n);
        show("{:>10.1f}\n", 1e3 * measure(device, kFull, k1080p, n).seconds);
    }
}

}  // namespace

void print_nsrr_table(const Device& device, const std::string& table) {
    if (table != "1" && table != "2" && table != "5")
        fail(ErrorKind::invalid_argument, "no table {} of runtimes; there are 1, 2 and 5", table);
    show("{}, ×4, fp32, medians of {} frames\n", device.profile().name, kFrames);
    if (table == "1") {
        const double peak = measure::most_operations(measure::peak_sweep(device)).operations_a_second;
        fmt::print("multiply–add peak {:.1f} GFLOP/s\n", 1e-9 * peak);
        print_sizes(device, peak);
    } else if (table == "2") {
        print_stages(device);
    } else {
        print_previous_frames(device);
    }
}

}  // namespace clarus::bench
