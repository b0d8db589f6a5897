#include "measure/bench.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <list>
#include <map>
#include <memory>
#include <utility>

#include "api/build_graph.h"
#include "base/error.h"
#include "base/explain.h"
#include "cl/context.h"
#include "cl/error.h"
#include "io/safetensors.h"
#include "measure/item_run.h"
#include "measure/start.h"
#include "measure/work.h"

namespace clarus::measure {
namespace {

constexpr int kFewestTurns = 6;  // that bound a median (median_ranks)
constexpr int kPeakTurns = 40;   // at most
constexpr int kPeakRuns = 3;     // a turn

double seconds_of(const BenchOptions& options) {
    if (options.seconds) return *options.seconds;
    switch (options.profile) {
        case Profile::quick:
            return 6;
        case Profile::full:
            return 20;
        case Profile::sustained:
            break;
    }
    return 180;
}

/// What a device can do at most, measured in turns.
class Peaks {
  public:
    explicit Peaks(const Device& device)
        : device_(device), compute_(most_operations(peak_sweep(device)).work), copy_(copy_work(device)) {
        if (const std::vector<Work> sweep = int8_peak_sweep(device); !sweep.empty())
            int8_ = most_operations(sweep).work;
    }

    bool has(int turns) const { return static_cast<int>(operations_.size()) >= turns; }
    void take_turn() {
        operations_.push_back(compute_.operations / seconds(compute_));
        bytes_.push_back(copy_.bytes / seconds(copy_));
        if (int8_) int8_operations_.push_back(int8_->operations / seconds(*int8_));
    }
    DeviceResult result() const {
        const cl::Device& device = device_.context().device();
        return {device_.profile(),
                cl::Platform(device.getInfo<CL_DEVICE_PLATFORM>()).getInfo<CL_PLATFORM_VERSION>(),
                device.getInfo<CL_DEVICE_OPENCL_C_VERSION>(),
                summarise(operations_),
                int8_ ? std::optional(summarise(int8_operations_)) : std::nullopt,
                summarise(bytes_)};
    }

  private:
    static double seconds(const Work& work) {
        work.run();  // after something else's turn: wakes threads
        std::vector<double> seconds;
        for (int run = 0; run < kPeakRuns; ++run) seconds.push_back(work.run());
        return median(seconds);
    }

    Device device_;
    Work compute_, copy_;
    std::optional<Work> int8_;
    std::vector<double> operations_, int8_operations_, bytes_;  // a second
};

ItemResult result_of(const BenchItem& item) {
    ItemResult result;
    result.device = item.device.profile().selector;
    result.model = item.model.name();
    result.pipeline = item.model.pipeline();
    result.checksum = checksum(item.model);
    result.scale = item.model.scale();
    if (const io::Safetensors* tensors = item.model.tensors()) result.parameters = tensors->elements();
    result.render_size = item.render_size;
    result.output_size = output_size(item.render_size, item.model.scale());
    result.precision = item.precision;
    return result;
}

class Bench {
  public:
    Bench(const BenchOptions& options, const std::vector<BenchItem>& items, const std::function<void(double)>& progress)
        : options_(options), items_(items), progress_(progress), done_(items.size()) {
        result_.version = options.version;
        result_.profile = options.profile;
        result_.tuning = options.tuning;
        const auto date = std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now());
        result_.date = fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(date));
        result_.host = host_facts();
        result_.clock_mhz_before = clock_mhz();
        for (const BenchItem& item : items) result_.items.push_back(result_of(item));
    }

    BenchResult run() {
        for (const BenchItem& item : items_) {
            const DeviceProfile& device = item.device.profile();
            try {
                ocl::checked("measure the peaks", [&] { peaks_.try_emplace(device.selector, item.device); });
            } catch (const Error& error) {
                fail(error.kind(), "{} ({}): {}; --devices names those to be measured", device.name, device.selector,
                     error.what());
            }
        }
        // Under sustained load nothing else is to run.
        while (options_.profile == Profile::sustained && take_peaks(kFewestTurns)) {
        }
        for (size_t next = 0; next < items_.size();) {
            Group group = next_group(next);
            measure(group);
            if (options_.interim) options_.interim(so_far());
        }
        while (take_peaks(kFewestTurns)) {
        }
        result_.devices = devices();
        result_.clock_mhz_after = clock_mhz();
        result_.seconds = now() - start_;
        return std::move(result_);
    }

  private:
    using Group = std::list<ItemRun>;

    std::vector<DeviceResult> devices() const {
        std::vector<DeviceResult> results;
        ocl::checked("ask devices for their versions", [&] {
            for (const auto& [selector, peaks] : peaks_) results.push_back(peaks.result());
        });
        return results;
    }

    BenchResult so_far() {
        while (take_peaks(1)) {
        }
        BenchResult result = result_;
        result.devices = devices();
        result.seconds = now() - start_;
        for (size_t i = result.items.size(); i-- > 0;)
            if (done_[i] < 1) result.items.erase(result.items.begin() + static_cast<ptrdiff_t>(i));
        return result;
    }

    /// A turn of every device's peaks, unless they have had as many; whether there was one.
    bool take_peaks(int turns) {
        bool any = false;
        for (auto& [selector, peaks] : peaks_) {
            if (peaks.has(turns)) continue;
            ocl::checked(fmt::format("measure the peaks of {}", selector), [&, &of = peaks] { of.take_turn(); });
            any = true;
        }
        return any;
    }

    /// Runs `step`; where it fails, that is why the item has no score.
    template <typename Step>
    bool succeeds(ItemResult& result, Step&& step) {
        try {
            step();
            return true;
        } catch (const std::exception& error) {  // the rest goes on, whatever it was
            result.no_score = explain(error);
            report(result, 1);
            return false;
        }
    }

    /// As many items as fit into memory together; `next` moves on.
    Group next_group(size_t& next) {
        Group group;
        size_t memory = 0;
        for (; next < items_.size(); ++next) {
            const BenchItem& item = items_[next];
            ItemResult& result = result_.items[next];
            if (!succeeds(result, [&] {
                    group.emplace_back(item, options_.tuning, options_.checks.find(item.model, item.render_size),
                                       result);
                }))
                continue;
            memory += group.back().memory();
            const bool alone = group.size() == 1;
            if (!alone &&
                (options_.profile == Profile::sustained || memory > item.device.profile().global_memory / 4)) {
                group.pop_back();
                break;
            }
        }
        return group;
    }

    void measure(Group& group) {
        for (auto run = group.begin(); run != group.end();) {
            const bool ready = succeeds(run->result(), [&] {
                // A start is with the kernels that are then timed: measured first, where they are to be.
                const bool tunes = options_.tuning == Tuning::measure;
                if (!tunes) measure_start_of(*run);
                run->prepare(sequences_);
                if (tunes) measure_start_of(*run);
                report(run->result(), 0.5);
            });
            run = ready ? std::next(run) : group.erase(run);
        }
        while (!group.empty()) {
            if (options_.profile != Profile::sustained) take_peaks(kPeakTurns);
            for (auto run = group.begin(); run != group.end();)
                run = take_turn(*run) ? std::next(run) : group.erase(run);
        }
    }

    void measure_start_of(ItemRun& run) {
        if (options_.tool.empty()) return;
        const BenchItem& item = run.item();
        const io::Safetensors* tensors = item.model.tensors();
        run.result().start = measure_start(
            options_.tool, {item.device.profile().selector, tensors ? tensors->path().string() : item.model.name(),
                            item.model.scale(), item.render_size, item.precision, options_.tuning});
    }

    /// Whether the item is to have another one.
    bool take_turn(ItemRun& run) {
        const bool sustained = options_.profile == Profile::sustained;
        double done = 0;  // 1: enough turns
        const bool succeeded = succeeds(run.result(), [&] {
            run.take_turn(start_);
            const double turns = static_cast<double>(run.turns()) / kFewestTurns,
                         time = run.seconds() / seconds_of(options_);
            done = std::min(turns, !sustained && run.is_steady() ? 1 : time);
            // While an image is read back and looked at, a device under sustained load would cool.
            if (!sustained || run.turns() == 1 || done >= 1) run.check_image();
        });
        if (!succeeded) return false;
        if (!run.is_wrong() && done < 1) {
            report(run.result(), 0.5 + 0.5 * done);
            return true;
        }
        run.finish();
        report(run.result(), 1);
        return false;
    }

    void report(const ItemResult& result, double done) {
        done_[&result - result_.items.data()] = done;
        if (!progress_) return;
        double sum = 0;
        for (const double each : done_) sum += each;
        progress_(sum / static_cast<double>(done_.size()));
    }

    const BenchOptions& options_;
    const std::vector<BenchItem>& items_;
    const std::function<void(double)>& progress_;
    std::vector<double> done_;  // of each item, 0…1
    DeviceSequences sequences_;
    std::map<std::string, Peaks> peaks_;  // by selector
    double start_ = now();
    BenchResult result_;
};

}  // namespace

BenchResult run_bench(const BenchOptions& options, const std::vector<BenchItem>& items,
                      const std::function<void(double)>& progress) {
    return Bench(options, items, progress).run();
}

bool add_check(Checks& checks, const BenchItem& item, Tuning tuning) {
    if (checks.find(item.model, item.render_size)) return false;
    UpscalerOptions options;
    options.tuning = tuning;
    DeviceSequences sequences;
    TimedUpscaler upscaler(item.device, item.model, item.render_size, options);
    upscaler.prepare(sequences);
    for (int index = 0; index < kSequenceFrames; ++index) upscaler.run(index);
    checks.set(item.model, item.render_size, sketch(upscaler.output_size(), upscaler.output()));
    return true;
}

}  // namespace clarus::measure
