#include "measure/device_json.h"

#include "cl/platforms.h"

namespace clarus::measure {

nlohmann::ordered_json to_json(const DeviceProfile& device) {
    return {{"selector", device.selector},
            {"name", device.name},
            {"vendor", device.vendor},
            {"platform", device.platform},
            {"driver_version", device.driver_version},
            {"opencl_version", device.opencl_version},
            {"class", ocl::class_name(device.device_class)},
            {"simulator", device.simulator},
            {"compute_units", device.compute_units},
            {"clock_mhz", device.clock_mhz},
            {"float_vector_width", device.float_vector_width},
            {"max_work_group_size", device.max_work_group_size},
            {"global_memory", device.global_memory},
            {"max_allocation", device.max_allocation},
            {"local_memory", device.local_memory},
            {"local_memory_is_dedicated", device.local_memory_is_dedicated},
            {"memory_alignment", device.memory_alignment},
            {"unified_memory", device.unified_memory},
            {"images", device.images},
            {"half_storage", device.half_storage},
            {"half_arithmetic", device.half_arithmetic},
            {"int8_dot_product", device.int8_dot_product},
            {"vnni", device.vnni},
            {"bf16", device.bf16},
            {"fast_fma", device.fast_fma},
            {"subgroups", device.subgroups},
            {"sub_devices", device.sub_devices},
            {"gl_sharing", device.gl_sharing},
            {"external_memory", device.external_memory}};
}

}  // namespace clarus::measure
