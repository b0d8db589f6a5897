#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <limits>
#include <map>
#include <string_view>

#include "base/error.h"
#include "bench/random_model.h"
#include "bench/suite.h"
#include "measure/statistics.h"

namespace clarus::bench {
namespace {

/// Google Benchmark's console output replaced by a record of every repetition's time.
class Record : public benchmark::BenchmarkReporter {
  public:
    bool ReportContext(const Context&) override { return true; }
    void ReportRuns(const std::vector<Run>& runs) override {
        for (const Run& run : runs) {
            if (run.run_type != Run::RT_Iteration || run.error_occurred) continue;
            seconds_[run.benchmark_name()].push_back(run.real_accumulated_time / static_cast<double>(run.iterations));
        }
    }
    double median(const std::string& name) const {
        for (const auto& [full_name, seconds] : seconds_) {
            if (full_name.rfind(name + "/", 0) == 0) return measure::median(seconds);
        }
        return 0;  // filtered out
    }

  private:
    std::map<std::string, std::vector<double>> seconds_;
};

// One after the other, because a single run after a pause is one of a core that has just been woken.
constexpr int kRunsATurn = 4;

void enroll(const std::string& name, int repetitions, std::function<double()> run) {
    benchmark::RegisterBenchmark(name.c_str(),
                                 [run = std::move(run)](benchmark::State& state) {
                                     run();  // after something else's turn: wakes threads and fills caches
                                     for ([[maybe_unused]] auto turn : state) state.SetIterationTime(run());
                                 })
        ->UseManualTime()
        ->Iterations(kRunsATurn)
        ->Repetitions(repetitions);
}

/// The modules of a network whose stages are named after them ("blending: …"), such as those of MNSS's table 3.
void print_modules(const std::vector<StageProfile>& stages) {
    std::vector<std::pair<std::string, double>> modules;
    for (const StageProfile& stage : stages) {
        const size_t end = stage.name.find(": ");
        if (end == std::string::npos) continue;
        const std::string module = stage.name.substr(0, end);
        const auto known =
            std::find_if(modules.begin(), modules.end(), [&](const auto& each) { return each.first == module; });
        (known == modules.end() ? modules.emplace_back(module, 0) : *known).second += stage.seconds;
    }
    if (modules.empty()) return;
    fmt::print("\n{:<20}{:>9}\n", "module", "ms");
    for (const auto& [module, seconds] : modules) fmt::print("{:<20}{:>9.2f}\n", module, 1e3 * seconds);
}

/// A seconds figure and what it is a share of.
void print_frame(FrameBench& frame, double median, double peak, double bandwidth) {
    const std::vector<StageProfile> stages = frame.stages();
    double dense = 0, floor = 0;
    fmt::print("\n{} at {}\n{:<20}{:>9}{:>9}{:>10}{:>8}  {}\n", frame.name(), frame.size(), "stage", "ms", "floor",
               "GFLOP/s", "GB/s", "kernel");
    for (const StageProfile& stage : stages) {
        const double least = std::max(stage.operations / peak, stage.bytes / bandwidth);
        floor += least;
        if (is_convolution(stage)) dense += stage.operations / peak;
        fmt::print("{:<20}{:>9.2f}{:>9.2f}{:>10.1f}{:>8.1f}  {}\n", stage.name, 1e3 * stage.seconds, 1e3 * least,
                   1e-9 * stage.operations / stage.seconds, 1e-9 * stage.bytes / stage.seconds, stage.kernel);
    }
    const MemoryRequirements memory = frame.memory();
    fmt::print("{:<20}{:>9.2f}{:>9.2f}\n", "frame", 1e3 * median, 1e3 * floor);
    if (dense > 0) fmt::print("{:.2f} × the dense convolutions at the peak ({:.2f} ms)\n", median / dense, 1e3 * dense);
    fmt::print("memory: arena {:.1f} MiB, live at the worst moment {:.1f} MiB (ratio {:.3f}), weights {:.1f} MiB\n",
               memory.arena / 1048576.0, memory.peak_live_bytes / 1048576.0,
               static_cast<double>(memory.arena) / static_cast<double>(memory.peak_live_bytes),
               memory.weights / 1048576.0);
    print_modules(stages);
}

int run(int argc, char** argv) {
    benchmark::Initialize(&argc, argv);
    constexpr std::string_view kNsrrTable = "nsrr-table-";
    if (argc > 1 && std::string_view(argv[1]).starts_with(kNsrrTable)) {
        print_nsrr_table(Device::open(argc > 2 ? argv[2] : "auto"), argv[1] + kNsrrTable.size());
        return EXIT_SUCCESS;
    }
    const char* selector = argc > 1 ? argv[1] : "auto";
    const Device device = Device::open(selector);
    fmt::print("{} ({}, {} compute units)\n", device.profile().name, device.profile().opencl_version,
               device.profile().compute_units);

    constexpr int kKernelRepetitions = 15, kFrameRepetitions = 15, kHeavyFrameRepetitions = 3;
    const std::vector<Work> peaks = measure::peak_sweep(device), convolutions = convolution_items(device);
    const Work copy = measure::copy_work(device);
    for (const Work& item : peaks) enroll("peak " + item.name, kKernelRepetitions, item.run);
    for (const Work& item : convolutions) enroll("convolution " + item.name, kKernelRepetitions, item.run);
    enroll(copy.name, kKernelRepetitions, copy.run);
    const RenderItem rendering = render_item();
    enroll(rendering.work.name, kFrameRepetitions, rendering.work.run);
    std::vector<std::unique_ptr<FrameBench>> frames;
    measure::DeviceSequences sequences;
    const auto add = [&](const char* name, const Model& model, Size render, int repetitions,
                         const UpscalerOptions& options = {}) {
        frames.push_back(std::make_unique<FrameBench>(device, name, model, render, sequences, options));
        enroll(name, repetitions, [&frame = *frames.back()] { return frame.run(); });
    };
    add("ENSS-S", random_enss(2, 16, 1), {960, 540}, kFrameRepetitions);
    add("ENSS-M", random_enss(2, 32, 3), {960, 540}, kFrameRepetitions);
    add("ENSS-L", random_enss(2, 64, 5), {960, 540}, kFrameRepetitions);
    add("NSRR", random_nsrr(4, 4, 32), {480, 270}, kHeavyFrameRepetitions);
    add("NSRR-fast", random_nsrr(4, 4, 16), {480, 270}, kHeavyFrameRepetitions);
    UpscalerOptions sharpened;
    sharpened.sharpen = 0.15f;
    add("MNSS-x2", random_mnss(2), {960, 540}, kFrameRepetitions, sharpened);
    add("MNSS-x3", random_mnss(3), {640, 360}, kFrameRepetitions, sharpened);
    UpscalerOptions antialiased;
    antialiased.antialias = Antialiasing::mlaa;
    add("SRPO-x2", random_srpo(2), {960, 540}, kFrameRepetitions, antialiased);
    add("SRPO-x3", random_srpo(3), {640, 360}, kFrameRepetitions, antialiased);
    for (const char* filter : {"nearest", "bilinear", "bicubic", "lanczos", "fsr1", "fsr2"})
        add(filter, Model::filter(filter, 2), {960, 540}, kFrameRepetitions);

    Record record;
    benchmark::RunSpecifiedBenchmarks(&record);

    const double by_clpeak = clpeak_peak(device);
    double by_sweep = 0, by_convolutions = 0;
    std::string widest;
    for (const Work& item : peaks) {
        const double seconds = record.median("peak " + item.name);
        if (seconds == 0 || item.operations / seconds <= by_sweep) continue;
        by_sweep = item.operations / seconds;
        widest = item.name;
    }
    for (const Work& item : convolutions) {
        const double seconds = record.median("convolution " + item.name);
        // Winograd does fewer operations than are counted.
        if (seconds > 0 && item.name.find("winograd") == std::string::npos)
            by_convolutions = std::max(by_convolutions, item.operations / seconds);
    }
    const double peak = std::max({by_clpeak, by_sweep, by_convolutions});
    // Filtered out, it is no limit.
    const double copy_seconds = record.median("copy");
    const double bandwidth = copy_seconds > 0 ? copy.bytes / copy_seconds : std::numeric_limits<double>::infinity();
    fmt::print(
        "\nmultiply–add peak {:.1f} GFLOP/s: the most of a sweep ({:.1f}, {}), clpeak ({:.1f}), convolutions "
        "({:.1f})\n",
        1e-9 * peak, 1e-9 * by_sweep, widest, 1e-9 * by_clpeak, 1e-9 * by_convolutions);
    if (copy_seconds > 0) fmt::print("copy bandwidth {:.1f} GB/s\n", 1e-9 * bandwidth);

    fmt::print("\nconvolution 3×3 at 960×540\n{:<52}{:>9}{:>10}{:>10}\n", "", "ms", "GFLOP/s", "of peak");
    for (const Work& item : convolutions) {
        const double seconds = record.median("convolution " + item.name);
        if (seconds > 0)
            fmt::print("{:<52}{:>9.2f}{:>10.1f}{:>9.0f}%\n", item.name, 1e3 * seconds, 1e-9 * item.operations / seconds,
                       100 * item.operations / seconds / peak);
    }
    for (const auto& frame : frames) {
        const double median = record.median(frame->name());
        if (median > 0) print_frame(*frame, median, peak, bandwidth);
    }
    const double render = record.median(rendering.work.name);
    if (render > 0)
        fmt::print("\nsample renderer, demo scene, one core: {:.2f} million primary rays a second\n",
                   1e-6 * rendering.rays / render);
    return EXIT_SUCCESS;
}

}  // namespace
}  // namespace clarus::bench

int main(int argc, char** argv) {
    try {
        return clarus::bench::run(argc, argv);
    } catch (const clarus::Error& error) {
        fmt::print(stderr, "clarus_bench: {}\n", error.what());
        return EXIT_FAILURE;
    }
}
