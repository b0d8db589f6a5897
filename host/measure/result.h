#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "clarus/device.h"
#include "clarus/stream.h"
#include "measure/host_facts.h"
#include "measure/statistics.h"

namespace clarus::measure {

enum class Profile { quick, full, sustained };

// What a result file holds; bench/schema.json says it in full. Times in seconds, rates a second.

struct DeviceResult {
    DeviceProfile profile;
    std::string platform_version, opencl_c_version;
    Figure compute_peak;              // operations
    std::optional<Figure> int8_peak;  // where the device multiplies bytes by an instruction of its own
    Figure copy_bandwidth;            // bytes
};

struct StageResult {
    std::string name, kernel;
    Figure seconds;
    double operations = 0, bytes = 0;

    /// Operations a second that its kernel could do at most.
    double peak(const DeviceResult& device) const;
};

struct TurnResult {
    double at = 0;  // since the run's start
    double latency = 0;
    std::optional<double> clock_mhz;
};

struct Score {
    Figure latency;
    double p95 = 0, p99 = 0;
    int frames = 0;  // of which those are
    Figure frames_per_second, device_seconds;
    std::vector<StageResult> stages;
    std::vector<TurnResult> turns;

    double operations() const;
    double bytes() const;
    /// The least that the stages could take: each the longer of its operations at the peak and its bytes at the
    /// bandwidth.
    double roofline_seconds(const DeviceResult& device) const;
    double roofline_share(const DeviceResult& device) const { return roofline_seconds(device) / device_seconds.median; }
};

struct Check {
    enum class Result { passed, failed, unchecked };
    Result result = Result::unchecked;
    std::optional<double> largest_difference, tolerance;
    std::string reason;  // why it failed or is unchecked
};

/// Of new processes: seconds to their first frame, and the programs that they compiled.
struct Start {
    double cold = 0, warm = 0;
    int programs = 0;  // of the cold start
    double other_size = 0;
    int other_size_programs = 0;
};

struct ItemResult {
    std::string device;  // selector
    std::string model, pipeline, checksum;
    double scale = 1;
    int64_t parameters = 0;
    Size render_size, output_size;
    Precision precision = Precision::fp32;
    std::optional<MemoryRequirements> memory;
    Check check;
    std::optional<Start> start;
    std::optional<Score> score;
    std::string no_score;  // why there is none
};

struct BenchResult {
    std::string version;  // of Clarus
    Profile profile = Profile::quick;
    Tuning tuning = Tuning::stored;
    std::string date;  // UTC
    double seconds = 0;
    HostFacts host;
    std::optional<double> clock_mhz_before, clock_mhz_after;
    std::vector<DeviceResult> devices;
    std::vector<ItemResult> items;

    const DeviceResult& device_of(const ItemResult& item) const;
    /// Errors: file.
    void write(const std::filesystem::path& path) const;
};

/// Device memory that is Clarus's own, in bytes: images are the caller's.
inline size_t without_images(const MemoryRequirements& memory) { return memory.arena + memory.weights; }
/// "1920x1080"
std::string text_of(Size size);

}  // namespace clarus::measure
