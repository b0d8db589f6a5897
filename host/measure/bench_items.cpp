#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "base/error.h"
#include "measure/bench.h"

namespace clarus::measure {
namespace {

constexpr Size k720p{1280, 720}, kHeadset{1080, 1200}, k1080p{1920, 1080}, k4k{3840, 2160};
constexpr double kFilterScale = 2;
constexpr const char* kSustainedModel = "enss-m-x2";

std::vector<Device> open_devices(std::vector<std::string> selectors) {
    if (selectors.empty()) {
        for (const DeviceProfile& device : list_devices())
            if (!device.simulator) selectors.push_back(device.selector);
        if (selectors.empty())
            fail(ErrorKind::no_device,
                 "there is no device but simulators; `clarus devices` lists them, --devices names any");
    }
    std::vector<Device> devices;
    for (const std::string& selector : selectors) {
        Device device = Device::open(selector);
        if (std::none_of(devices.begin(), devices.end(),
                         [&](const Device& other) { return other.profile().selector == device.profile().selector; }))
            devices.push_back(std::move(device));
    }
    return devices;
}

/// One of each: "enss-s-x2" stands for "enss-s-x3" as well, and "mnss-x2-int8" for "mnss-x3-int8".
std::vector<Model> smallest_scales(const std::vector<Model>& models) {
    std::vector<Model> result;
    std::map<std::string, size_t> places;
    for (const Model& model : models) {
        std::string family = model.name();
        const std::string scale = fmt::format("-x{:g}", model.scale());
        if (const size_t at = (family + "-").find(scale + "-"); at != std::string::npos) family.erase(at, scale.size());
        const auto [known, is_new] = places.emplace(family, result.size());
        if (is_new)
            result.push_back(model);
        else if (model.scale() < result[known->second].scale())
            result[known->second] = model;
    }
    return result;
}

std::vector<Model> find_models(const BenchOptions& options) {
    const std::vector<std::string> shipped = Model::names();
    std::vector<std::string> names = options.models;
    if (names.empty() && options.profile == Profile::sustained) {
        const bool there = std::find(shipped.begin(), shipped.end(), kSustainedModel) != shipped.end();
        names = {there ? kSustainedModel : shipped.front()};
    }
    std::vector<Model> models;
    for (const std::string& name : names.empty() ? shipped : names) models.push_back(Model::find(name, kFilterScale));
    return names.empty() && options.profile == Profile::quick ? smallest_scales(models) : models;
}

std::vector<Size> output_sizes(const BenchOptions& options) {
    if (!options.sizes.empty()) return options.sizes;
    if (options.profile == Profile::full) return {k720p, kHeadset, k1080p, k4k};
    return {k1080p};
}

/// Those that the device can store, or multiply in.
std::vector<Precision> precisions(const BenchOptions& options, const DeviceProfile& device) {
    std::vector<Precision> result = options.precisions;
    if (result.empty()) {
        result = {Precision::fp32};
        if (options.profile == Profile::full || (options.profile == Profile::quick && device.half_arithmetic))
            result.push_back(Precision::fp16);
    }
    if (!device.half_storage) std::erase(result, Precision::fp16);
    if (!device.bf16) std::erase(result, Precision::bf16);
    return result;
}

Size render_size(Size output, double scale) {
    const auto side = [&](int length) { return std::max(1, static_cast<int>(std::lround(length / scale))); };
    return {side(output.width), side(output.height)};
}

}  // namespace

std::vector<BenchItem> bench_items(const BenchOptions& options) {
    const std::vector<Device> devices = open_devices(options.devices);
    const std::vector<Model> models = find_models(options);
    std::vector<BenchItem> items;
    for (const Size size : output_sizes(options))
        for (const Model& model : models)
            for (const Device& device : devices)
                for (const Precision precision : precisions(options, device.profile()))
                    items.push_back({device, model, render_size(size, model.scale()), precision});
    if (items.empty())
        fail(ErrorKind::invalid_argument,
             "none of the devices stores halves or multiplies bfloat16 as asked for; ask for fp32");
    return items;
}

}  // namespace clarus::measure
