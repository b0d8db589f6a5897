#include "api/kept_placement.h"

#include <fmt/format.h>

#include <cstdint>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>

#include "base/error.h"
#include "base/hash.h"
#include "base/log.h"
#include "base/output_file.h"
#include "base/private_files.h"
#include "clarus/device.h"
#include "clarus/version.h"
#include "io/json_reader.h"

namespace clarus {
namespace {

constexpr size_t kLargestFile = size_t{1} << 20;  // bytes

/// All that measured times depend on.
std::string described(const graph::Graph& graph, std::span<const DeviceProfile> devices,
                      const std::function<bool(int from, int to)>& copied, const StreamOptions& options) {
    std::string text = fmt::format("{} precision {} tuning {}\n", CLARUS_VERSION_STRING,
                                   static_cast<int>(options.precision), static_cast<int>(options.tuning));
    for (const DeviceProfile& device : devices)
        text += fmt::format("{}|{}|{}|{}|{}|{}|{}\n", device.platform, device.name, device.driver_version,
                            device.opencl_version, device.compute_units, device.clock_mhz,
                            static_cast<int>(device.device_class));
    const int count = static_cast<int>(devices.size());
    for (int from = 0; from < count; ++from)
        for (int to = 0; to < count; ++to) text += copied(from, to) ? '1' : '0';
    text += '\n';
    for (const graph::Node& node : graph.nodes) {
        text += fmt::format("{} {} {}x{}x{}", node.op.index(), node.name, node.shape.channels, node.shape.height,
                            node.shape.width);
        for (const graph::Value input : node.inputs) text += fmt::format(" {}", input);
        if (const auto* convolution = std::get_if<graph::Convolution>(&node.op)) {
            const graph::Parameters& parameters = *graph.parameters[convolution->parameters];
            text += fmt::format(" {} {} {} {}", parameters.kernel, parameters.groups, parameters.stride,
                                parameters.quantized.has_value());
        }
        text += '\n';
    }
    return text;
}

}  // namespace

KeptPlacement::KeptPlacement(const graph::Graph& graph, std::span<const DeviceProfile> devices,
                             const std::function<bool(int from, int to)>& copied, const StreamOptions& options)
    : nodes_(graph.nodes.size()), devices_(devices.size()) {
    const std::string folder = cache_directory();
    if (folder.empty()) return;
    const std::string text = described(graph, devices, copied, options);
    file_ = fmt::format("{}/placements/{}.json", folder, hexadecimal(hash_of(text)));
}

KeptPlacement::Choice KeptPlacement::find() const {
    if (file_.empty()) return {};
    const std::optional<std::string> text = read_private_file(file_, kLargestFile);
    const std::optional<nlohmann::json> json = text ? io::try_parse_json(*text) : std::nullopt;
    if (!json) return {};
    try {
        Choice choice;
        const std::filesystem::path file = file_;
        const io::JsonNode root(*json, file);
        const auto last = static_cast<int64_t>(devices_) - 1;
        for (const io::JsonNode& place : root["places"].items(nodes_))
            choice.places.push_back(static_cast<int>(place.integer(0, last)));
        for (const io::JsonNode& device : root["seconds"].items(devices_)) {
            std::vector<double>& its = choice.seconds.emplace_back();
            for (const io::JsonNode& seconds : device.items(nodes_))
                its.push_back(seconds.number(0, std::numeric_limits<double>::max()));
        }
        return choice;
    } catch (const Error&) {
        return {};
    }
}

void KeptPlacement::keep(const Choice& choice) const {
    if (file_.empty() || !make_private_folder(std::filesystem::path(file_).parent_path())) return;
    const std::string text = nlohmann::json{{"places", choice.places}, {"seconds", choice.seconds}}.dump() + '\n';
    try {
        OutputFile file(file_);
        file.write(std::as_bytes(std::span(text)));
        file.commit();
    } catch (const Error& error) {
        log(LogLevel::warning, "{}. The placement is measured again the next time", error.what());
    }
}

}  // namespace clarus
