#include "cl/selector.h"

#include <algorithm>
#include <mutex>
#include <optional>
#include <utility>

#include "base/lower_case.h"
#include "base/parse.h"
#include "cl/error.h"

namespace clarus::ocl {
namespace {

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

/// Parts of a device, of so many compute units each.
std::vector<cl::Device> sub_devices(const PlacedDevice& placed, const std::vector<int>& compute_units) {
    const auto available = int(placed.device.getInfo<CL_DEVICE_MAX_COMPUTE_UNITS>());
    int wanted = 0;
    for (const int units : compute_units) {
        if (units < 1 || units > available)
            fail(ErrorKind::invalid_argument, "a sub-device of {} compute units: device {} has {}", units,
                 placed.selector(), available);
        wanted += units;
    }
    if (wanted > available)
        fail(ErrorKind::invalid_argument, "sub-devices of {} compute units in all: device {} has {}", wanted,
             placed.selector(), available);
    // A partition by counts gives just those wanted. Some drivers only part equally: then they are the first of its
    // parts.
    std::vector<cl_device_partition_property> by_counts{CL_DEVICE_PARTITION_BY_COUNTS};
    by_counts.insert(by_counts.end(), compute_units.begin(), compute_units.end());
    by_counts.insert(by_counts.end(), {CL_DEVICE_PARTITION_BY_COUNTS_LIST_END, 0});
    std::vector<std::vector<cl_device_partition_property>> partitions{by_counts};
    if (std::all_of(compute_units.begin(), compute_units.end(), [&](int units) { return units == compute_units[0]; }))
        partitions.push_back({CL_DEVICE_PARTITION_EQUALLY, compute_units[0], 0});
    for (const auto& partition : partitions) {
        try {
            std::vector<cl::Device> parts;
            cl::Device(placed.device).createSubDevices(partition.data(), &parts);
            if (parts.size() < compute_units.size()) continue;
            parts.resize(compute_units.size());
            for (cl::Device& part : parts) part = kept(part);
            return parts;
        } catch (const cl::Error&) {
        }
    }
    fail(ErrorKind::invalid_argument, "device {} ({}) cannot be parted: select it without '/{}'", placed.selector(),
         placed.device.getInfo<CL_DEVICE_NAME>(), compute_units[0]);
}

std::optional<DeviceClass> class_named(std::string_view name) {
    for (const DeviceClass each : {DeviceClass::gpu, DeviceClass::cpu, DeviceClass::dsp})
        if (name == class_name(each)) return each;
    return {};
}

/// What a selector says.
struct Wanted {
    PlacedDevice placed;
    std::optional<int> compute_units;
    std::optional<DeviceClass> taken_as;
};

Wanted wanted_device(std::string_view selector, const std::vector<PlacedDevice>& all) {
    Wanted result;
    std::string wanted = lower_case(std::string(trimmed(selector)));
    if (const size_t equals = wanted.rfind('='); equals != wanted.npos) {
        const std::string_view name = trimmed(std::string_view(wanted).substr(equals + 1));
        if (!(result.taken_as = class_named(name)))
            fail(ErrorKind::invalid_argument, "the device '{}': '{}' is no class; gpu, cpu and dsp are", selector,
                 name);
        wanted = trimmed(std::string_view(wanted).substr(0, equals));
    }
    if (const size_t slash = wanted.rfind('/'); slash != wanted.npos)
        if ((result.compute_units = parse_whole<int>(std::string_view(wanted).substr(slash + 1)))) wanted.resize(slash);

    std::vector<PlacedDevice> fitting;
    std::copy_if(all.begin(), all.end(), std::back_inserter(fitting),
                 [&](const PlacedDevice& placed) { return fits(placed, wanted); });
    if (fitting.empty())
        fail(
            ErrorKind::no_device,
            "no device fits '{}'. A selector is auto, gpu, dsp, cpu, an index such as {} or a part of a name; after it "
            "/N for a sub-device of N compute units, =gpu, =cpu or =dsp for how it is to be treated; several between "
            "commas. There are:{}",
            selector, all.front().selector(), list(all));
    result.placed = *std::min_element(fitting.begin(), fitting.end(),
                                      [](const PlacedDevice& a, const PlacedDevice& b) { return rank(a) < rank(b); });
    return result;
}

}  // namespace

std::vector<SelectedDevice> select_devices(std::string_view selectors) {
    return checked(fmt::format("select the device '{}'", selectors), [&] {
        const std::vector<PlacedDevice> all = placed_devices();
        if (all.empty()) fail_without_device();
        std::vector<Wanted> wanted;
        std::vector<SelectedDevice> selected;
        for (const std::string_view selector : between_commas(selectors)) {
            Wanted each = wanted_device(selector, all);
            std::string place = each.placed.selector();
            for (const Wanted& other : wanted)
                if (other.placed.device() == each.placed.device() && !(other.compute_units && each.compute_units))
                    fail(ErrorKind::invalid_argument,
                         "the device {} is named twice in '{}'; parts of it would be '{}/1, {}/1'", place, selectors,
                         place, place);
            if (each.compute_units) place += fmt::format("/{}", *each.compute_units);
            if (each.taken_as) place += fmt::format("={}", class_name(*each.taken_as));
            selected.push_back({each.placed.device, place, each.taken_as});
            wanted.push_back(std::move(each));
        }
        for (size_t first = 0; first < wanted.size(); ++first) {
            std::vector<size_t> same;
            std::vector<int> units;
            for (size_t i = 0; i < wanted.size(); ++i) {
                if (!wanted[i].compute_units || wanted[i].placed.device() != wanted[first].placed.device()) continue;
                same.push_back(i);
                units.push_back(*wanted[i].compute_units);
            }
            if (same.empty() || same.front() != first) continue;
            const std::vector<cl::Device> parts = sub_devices(wanted[first].placed, units);
            for (size_t i = 0; i < same.size(); ++i) selected[same[i]].device = parts[i];
        }
        return selected;
    });
}

}  // namespace clarus::ocl
