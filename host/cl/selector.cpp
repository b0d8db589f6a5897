#include "cl/selector.h"

#include <algorithm>
#include <mutex>
#include <optional>
#include <utility>

#include "base/parse.h"
#include "cl/error.h"

namespace clarus::ocl {
namespace {

std::string lower_case(std::string text) {
    std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return char(std::tolower(c)); });
    return text;
}

std::string platform_name(const cl::Device& device) {
    return cl::Platform(device.getInfo<CL_DEVICE_PLATFORM>()).getInfo<CL_PLATFORM_NAME>();
}

bool fits(const PlacedDevice& placed, std::string_view selector) {
    if (selector.empty()) return false;  // every name holds it
    if (selector == "auto") return true;
    if (selector == "gpu" || selector == "cpu" || selector == "dsp")
        return selector == class_name(device_class(placed.device));
    if (const size_t colon = selector.find(':'); colon != selector.npos) {
        const auto platform = parse_whole<int>(selector.substr(0, colon)),
                   device = parse_whole<int>(selector.substr(colon + 1));
        if (platform && device) return platform == placed.platform_index && device == placed.device_index;
    }
    return lower_case(placed.device.getInfo<CL_DEVICE_NAME>()).find(selector) != std::string::npos ||
           lower_case(platform_name(placed.device)).find(selector) != std::string::npos;
}

// The best has the least.
auto rank(const PlacedDevice& placed) {
    const DeviceClass kind = device_class(placed.device);
    const int class_rank = kind == DeviceClass::gpu ? 0 : kind == DeviceClass::dsp ? 1 : 2;
    return std::pair(class_rank, -std::int64_t(placed.device.getInfo<CL_DEVICE_MAX_COMPUTE_UNITS>()));
}

std::string list(const std::vector<PlacedDevice>& devices) {
    std::string text;
    for (const PlacedDevice& placed : devices)
        text += fmt::format("\n  {}  {}  {} ({})", placed.selector(), class_name(device_class(placed.device)),
                            placed.device.getInfo<CL_DEVICE_NAME>(), platform_name(placed.device));
    return text;
}

// Keeps a sub-device until the process ends: PoCL 3.1 frees one with its last reference although a worker thread of its
// may still be taking leave of the last event.
cl::Device kept(const cl::Device& device) {
    static std::mutex mutex;
    static auto& devices = *new std::vector<cl::Device>;
    const std::lock_guard lock(mutex);
    return devices.emplace_back(device);
}

cl::Device sub_device(const PlacedDevice& placed, int compute_units) {
    const auto available = int(placed.device.getInfo<CL_DEVICE_MAX_COMPUTE_UNITS>());
    if (compute_units < 1 || compute_units > available)
        fail(ErrorKind::invalid_argument, "a sub-device of {} compute units: device {} has {}", compute_units,
             placed.selector(), available);
    // A partition by counts gives just the one wanted. Some drivers only part equally: then it is the first of its
    // parts.
    const cl_device_partition_property by_counts[] = {CL_DEVICE_PARTITION_BY_COUNTS, compute_units,
                                                      CL_DEVICE_PARTITION_BY_COUNTS_LIST_END, 0};
    const cl_device_partition_property equally[] = {CL_DEVICE_PARTITION_EQUALLY, compute_units, 0};
    for (const cl_device_partition_property* partition : {by_counts, equally}) {
        try {
            std::vector<cl::Device> parts;
            cl::Device(placed.device).createSubDevices(partition, &parts);
            if (!parts.empty()) return kept(parts.front());
        } catch (const cl::Error&) {
        }
    }
    fail(ErrorKind::invalid_argument, "device {} ({}) cannot be parted: select it without '/{}'", placed.selector(),
         placed.device.getInfo<CL_DEVICE_NAME>(), compute_units);
}

}  // namespace

SelectedDevice select_device(std::string_view selector) {
    std::string wanted = lower_case(std::string(selector));
    std::optional<int> compute_units;
    if (const size_t slash = wanted.rfind('/'); slash != wanted.npos)
        if ((compute_units = parse_whole<int>(std::string_view(wanted).substr(slash + 1)))) wanted.resize(slash);

    return checked(fmt::format("select the device '{}'", selector), [&]() -> SelectedDevice {
        const std::vector<PlacedDevice> all = placed_devices();
        std::vector<PlacedDevice> fitting;
        std::copy_if(all.begin(), all.end(), std::back_inserter(fitting),
                     [&](const PlacedDevice& placed) { return fits(placed, wanted); });
        if (all.empty())
            fail(ErrorKind::no_device,
                 "OpenCL has a platform but no device. For the processor install PoCL (Debian: apt install "
                 "pocl-opencl-icd)");
        if (fitting.empty())
            fail(ErrorKind::no_device,
                 "no device fits '{}'. A selector is auto, gpu, dsp, cpu, an index such as {} or a "
                 "part of a name. There are:{}",
                 selector, all.front().selector(), list(all));

        const PlacedDevice& best =
            *std::min_element(fitting.begin(), fitting.end(),
                              [](const PlacedDevice& a, const PlacedDevice& b) { return rank(a) < rank(b); });
        if (!compute_units) return {best.device, best.selector()};
        return {sub_device(best, *compute_units), fmt::format("{}/{}", best.selector(), *compute_units)};
    });
}

}  // namespace clarus::ocl
