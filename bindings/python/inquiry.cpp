#include <fmt/format.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "arrays.h"
#include "clarus/device.h"
#include "clarus/error.h"
#include "clarus/jitter.h"
#include "clarus/model.h"
#include "clarus/quality.h"
#include "module.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace clarus::python {
namespace {

const char* word(DeviceClass device_class) {
    switch (device_class) {
        case DeviceClass::gpu:
            return "gpu";
        case DeviceClass::cpu:
            return "cpu";
        case DeviceClass::dsp:
            break;
    }
    return "dsp";
}

std::pair<float, float> pair_of(Vec2 vector) { return {vector.x, vector.y}; }

// What takes long lets other threads of Python run.
using Released = nb::call_guard<nb::gil_scoped_release>;

void add_devices(nb::module_& module) {
    nb::class_<DeviceProfile>(module, "DeviceProfile", "What Clarus knows of a device. Sizes are in bytes.")
        .def_ro("selector", &DeviceProfile::selector, "What Device takes to open this one.")
        .def_ro("name", &DeviceProfile::name)
        .def_ro("vendor", &DeviceProfile::vendor)
        .def_ro("platform", &DeviceProfile::platform)
        .def_ro("driver_version", &DeviceProfile::driver_version)
        .def_ro("opencl_version", &DeviceProfile::opencl_version)
        .def_prop_ro(
            "device_class", [](const DeviceProfile& profile) { return word(profile.device_class); },
            "\"gpu\", \"cpu\" or \"dsp\".")
        .def_ro("simulator", &DeviceProfile::simulator)
        .def_ro("compute_units", &DeviceProfile::compute_units)
        .def_ro("clock_mhz", &DeviceProfile::clock_mhz)
        .def_ro("global_memory", &DeviceProfile::global_memory)
        .def_ro("max_allocation", &DeviceProfile::max_allocation)
        .def_ro("local_memory", &DeviceProfile::local_memory)
        .def_ro("unified_memory", &DeviceProfile::unified_memory)
        .def_ro("half_storage", &DeviceProfile::half_storage)
        .def_ro("half_arithmetic", &DeviceProfile::half_arithmetic)
        .def("__repr__", [](const DeviceProfile& profile) {
            return fmt::format("<clarus.DeviceProfile {}: {}, {}>", profile.selector, profile.name,
                               word(profile.device_class));
        });
    nb::class_<Device>(module, "Device", "A device, or several that work together, for Upscalers to share.")
        .def(
            "__init__", [](Device* self, const std::string& selector) { new (self) Device(Device::open(selector)); },
            "selector"_a = "auto", Released(),
            "\"auto\", a class (\"gpu\", \"cpu\", \"dsp\"), an index (\"0:1\"), a part of a name, or several between "
            "commas. Raises NoDeviceError, InvalidArgumentError.")
        .def_prop_ro("profiles", &Device::profiles, "Of each device, in their order.")
        .def("__repr__", [](const Device& device) {
            std::string selectors;
            for (const DeviceProfile& profile : device.profiles())
                selectors += (selectors.empty() ? "" : ", ") + profile.selector;
            return fmt::format("<clarus.Device {}>", selectors);
        });
    module.def("devices", &list_devices, Released(),
               "Every device of every OpenCL platform. Raises NoDeviceError where there is no platform.");
    module.def("cache_directory", &cache_directory,
               "The folder of compiled programs and measurements; \"\" where there is none.");
}

void add_models(nb::module_& module) {
    nb::class_<PipelineOption>(module, "PipelineOption", "A setting that a model's pipeline has of its own.")
        .def_ro("name", &PipelineOption::name)
        .def_ro("help", &PipelineOption::help)
        .def_ro("smallest", &PipelineOption::smallest)
        .def_ro("largest", &PipelineOption::largest)
        .def_ro("usual", &PipelineOption::usual, "Its value unless told.")
        .def_ro("whole", &PipelineOption::whole, "Whether it takes whole numbers only.")
        .def("__repr__", [](const PipelineOption& option) {
            return fmt::format("<clarus.PipelineOption {}: {}>", option.name, option.range());
        });
    nb::class_<Model>(module, "Model", "A network with its weights, or a filter.")
        .def(
            "__init__",
            [](Model* self, const std::string& name, std::optional<double> scale) {
                new (self) Model(find_model(name, scale));
            },
            "name"_a, "scale"_a = nb::none(), Released(),
            "A name of models(), or a file. `scale` is of filters and of models without a scale of their own; 2 where "
            "it is not given. Raises FileError, InvalidArgumentError.")
        .def_prop_ro("name", &Model::name)
        .def_prop_ro("pipeline", &Model::pipeline)
        .def_prop_ro("scale", &Model::scale)
        .def_prop_ro(
            "scales",
            [](const Model& model) {
                const ScaleRange scales = model.scales();
                return std::pair(scales.smallest, scales.largest);
            },
            "The smallest and the largest that it can be found with; that of filters is infinite.")
        .def_prop_ro("metadata", &Model::metadata)
        .def_prop_ro("options", &Model::options, "What Upscaler's pipeline_options may set.")
        .def("__repr__",
             [](const Model& model) { return fmt::format("<clarus.Model {}, x{:g}>", model.name(), model.scale()); });
    module.def("models", &Model::names, Released(), "Names that Model knows: shipped models, then filters.");
}

void add_quality_modes(nb::module_& module) {
    module.def("quality_modes", &quality_modes, "From the least to the largest scale.");
    module.def(
        "quality_scale", [](const std::string& mode) { return quality_scale(mode); }, "mode"_a,
        "Output over render size, along each axis.");
    module.def(
        "quality_render_size",
        [](Pair output_size, double scale) {
            const Size size = quality_render_size({output_size.first, output_size.second}, scale);
            return Pair(size.width, size.height);
        },
        "output_size"_a, "scale"_a, "What to render for an output of this size: (width, height).");
    module.def("jitter_count", &jitter_count, "scale"_a,
               "How many points of a jitter sequence give each output pixel eight samples.");
    module.def("mip_bias", &mip_bias, "scale"_a, "To add to the bias of the textures' mip levels.");
}

}  // namespace

Model find_model(const std::string& name, std::optional<double> scale) {
    Model model = Model::find(name, scale.value_or(2));
    if (scale && *scale != model.scale())
        throw Error(ErrorKind::invalid_argument,
                    fmt::format("scale: {}, but {} upscales by {}", *scale, model.name(), model.scale()));
    return model;
}

void add_inquiry(nb::module_& module) {
    add_devices(module);
    add_models(module);
    add_quality_modes(module);
    module.def(
        "halton_jitter", [](int frame, int count) { return pair_of(halton_jitter(frame, count)); }, "frame"_a,
        "count"_a,
        "Halton's pattern, which repeats after `count` points: (x, y) in render pixels. `frame` is 0 or more.");
    module.def(
        "mnss_jitter", [](int frame, int scale) { return pair_of(mnss_jitter(frame, scale)); }, "frame"_a, "scale"_a,
        "MNSS's sub-pixel pattern of the scales 2 and 3: (x, y) in render pixels.");
    module.def(
        "random_jitter", [](int frame, int scale) { return pair_of(random_jitter(frame, scale)); }, "frame"_a,
        "scale"_a, "A sub-pixel's centre by chance, the same for a frame every time: (x, y) in render pixels.");
}

}  // namespace clarus::python
