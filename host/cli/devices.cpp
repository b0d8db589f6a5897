#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/json_text.h"
#include "cl/platforms.h"
#include "clarus/device.h"
#include "cli/commands.h"
#include "measure/device_json.h"

namespace clarus::cli {
namespace {

std::string bytes(size_t count) {
    if (count >= size_t(1) << 30) return fmt::format("{:.1f} GiB", double(count) / double(size_t(1) << 30));
    if (count >= size_t(1) << 20) return fmt::format("{:.1f} MiB", double(count) / double(size_t(1) << 20));
    if (count >= size_t(1) << 10) return fmt::format("{:.1f} KiB", double(count) / double(size_t(1) << 10));
    return fmt::format("{} B", count);
}

void print_table(const DeviceProfile& device) {
    const auto yes_no = [](bool value) { return value ? "yes" : "no"; };
    const std::pair<const char*, std::string> rows[] = {
        {"class", std::string(ocl::class_name(device.device_class))},
        {"platform", device.platform},
        {"vendor", device.vendor},
        {"driver", device.driver_version},
        {"OpenCL", device.opencl_version},
        {"compute units", fmt::format("{} at {} MHz", device.compute_units, device.clock_mhz)},
        {"float vector width", fmt::to_string(device.float_vector_width)},
        {"largest work-group", fmt::format("{} work-items", device.max_work_group_size)},
        {"global memory",
         fmt::format("{}, at most {} a buffer{}", bytes(device.global_memory), bytes(device.max_allocation),
                     device.unified_memory ? ", shared with the host" : "")},
        {"local memory", fmt::format("{}, {}", bytes(device.local_memory),
                                     device.local_memory_is_dedicated ? "dedicated" : "a part of global memory")},
        {"memory alignment", bytes(device.memory_alignment)},
        {"images", yes_no(device.images)},
        {"half storage", yes_no(device.half_storage)},
        {"half arithmetic", yes_no(device.half_arithmetic)},
        {"int8 dot product", yes_no(device.int8_dot_product)},
        {"VNNI", yes_no(device.vnni)},
        {"bfloat16", yes_no(device.bf16)},
        {"fast fma", yes_no(device.fast_fma)},
        {"sub-groups", yes_no(device.subgroups)},
        {"simulator", yes_no(device.simulator)},
        {"sub-devices", yes_no(device.sub_devices)},
        {"OpenGL's memory", yes_no(device.gl_sharing)},
        {"Vulkan's memory", yes_no(device.external_memory)},
    };
    fmt::print("{}  {}\n", device.selector, device.name);
    for (const auto& [name, value] : rows) fmt::print("     {:<19} {}\n", name, value);
}

void print_devices(bool as_json) {
    const std::vector<DeviceProfile> devices = list_devices();
    if (devices.empty()) ocl::fail_without_device();
    if (as_json) {
        auto list = nlohmann::ordered_json::array();
        for (const DeviceProfile& device : devices) list.push_back(measure::to_json(device));
        fmt::print("{}\n", json_text(list, 2));
    } else {
        for (const DeviceProfile& device : devices) print_table(device);
    }
}

}  // namespace

void add_devices_command(CLI::App& app) {
    CLI::App* command = app.add_subcommand("devices", "List the OpenCL devices and what they can do");
    const auto as_json = std::make_shared<bool>(false);
    command->add_flag("--json", *as_json, "Print JSON; sizes are in bytes");
    command->callback([as_json] { print_devices(*as_json); });
}

}  // namespace clarus::cli
