#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "base/rounding.h"
#include "runtime/implementations/convolution_input.h"
#include "runtime/implementations/lowering.h"

namespace clarus::runtime {
namespace {

constexpr int kBlock = 16;  // output channels that are computed as one vector

int blocks_of(const Problem& problem) { return ceil_divide(problem.parameters->out_channels, kBlock); }

Lowered lower(const Problem& problem, const Choices& choices, std::string file, std::array<size_t, 2> global) {
    const auto& convolution = std::get<graph::Convolution>(problem.node.op);
    Lowered lowered;
    KernelCall& call = lowered.call;
    call.file = std::move(file);
    call.entry = "convolution";
    const ConvolutionInput input(problem);
    call.options = fmt::format("-DCOUT={} -DKERNEL={} -DACTIVATION={}", problem.parameters->out_channels,
                               problem.parameters->kernel, convolution.activation == graph::Activation::relu ? 1 : 0);
    input.describe(call);
    add_images(call, {{"OUT", problem.output}});
    for (const auto& [name, value] : choices)
        if (name != "WG_X" && name != "WG_Y") call.options += fmt::format(" -D{}={}", name, value);
    call.arguments = input.arguments();
    call.arguments.insert(call.arguments.end(),
                          {{ArgumentKind::packed_weights}, {ArgumentKind::output}, {ArgumentKind::packed_offset}});
    call.global = global;
    call.local = choices.contains("WG_X") ? group_size(choices) : std::array<size_t, 2>{1, 1};
    return lowered;
}

/// A work-item for every input channel of a group and each of so many output channels.
Packing packing(const Problem& problem, const Choices& choices, std::string entry, int out_channels, size_t floats) {
    const graph::Parameters& parameters = *problem.parameters;
    const ConvolutionInput input(problem);
    Packing result;
    result.call.file = "pack";
    result.call.entry = std::move(entry);
    result.call.global = {static_cast<size_t>(parameters.in_channels / parameters.groups),
                          static_cast<size_t>(out_channels)};
    result.shape.in_channels = parameters.in_channels / parameters.groups;
    result.shape.out_channels = parameters.out_channels;
    result.shape.taps = parameters.taps();
    if (choices.contains("GROUP")) result.shape.group = choices.at("GROUP");
    for (const InputPart& part : input.parts) result.shape.part_channels.at(result.shape.parts++) = part.channels;
    result.floats = floats;
    return result;
}

/// Biases and taps for whole blocks of output channels.
Packing packing_in_blocks(const Problem& problem, const Choices& choices, std::string entry) {
    const int out_channels = kBlock * blocks_of(problem);
    return packing(problem, choices, std::move(entry), out_channels,
                   size_t(out_channels) * (1 + problem.parameters->taps() * problem.parameters->in_channels));
}

/// What every kernel but the plain one wants: pixels one after another, dense weights, a result for each pixel.
bool is_dense(const Problem& problem) {
    const auto in_pixels = [](const TensorLayout& layout) { return layout.block == 1; };
    return std::all_of(problem.inputs.begin(), problem.inputs.end(), in_pixels) && problem.parameters->groups == 1 &&
           problem.parameters->stride == 1;
}

// --- plain

Lowered lower_plain(const Problem& problem, const Choices& choices) {
    Lowered lowered = lower(problem, choices, "convolution_plain", pixels(problem.output));
    const graph::Parameters& parameters = *problem.parameters;
    lowered.call.options += fmt::format(" -DGROUPS={} -DSTRIDE={}", parameters.groups, parameters.stride);
    lowered.packing = packing(problem, choices, "pack_plain", parameters.out_channels,
                              parameters.out_channels + parameters.weights_per_set());
    return lowered;
}

// --- tiled: staged in local memory by many work-items

std::vector<Choices> tiled_choices(const Problem& problem, const DeviceProfile& profile) {
    constexpr int kChunk = 8;
    const int margin = problem.parameters->kernel - 1;
    // A larger kernel's chunk would be too many terms to sum in half.
    const bool half = problem.inputs[0].storage == Storage::f16 && profile.half_arithmetic && margin <= 2;
    std::vector<Choices> result;
    for (const size_t operand : half ? std::vector<size_t>{2, 4} : std::vector<size_t>{4}) {
        for (const auto& [width, height] : {std::pair{16, 8}, {32, 4}, {8, 8}}) {
            for (const int pixels_each : {4, 2}) {
                const size_t patch = operand * kChunk * (width * pixels_each + margin) * (height + margin);
                const size_t work_items = static_cast<size_t>(width) * height;
                if (patch > profile.local_memory || work_items > profile.max_work_group_size) continue;
                Choices choices{{"WG_X", width}, {"WG_Y", height}, {"PIXELS", pixels_each}, {"CHUNK", kChunk}};
                if (operand == 2) choices["HALF"] = 1;
                result.push_back(std::move(choices));
            }
        }
    }
    return result;
}

int prefer_tiled(const Problem& problem, const DeviceProfile& profile) {
    const bool fits = is_dense(problem) && !tiled_choices(problem, profile).empty();
    return fits && wants_many_work_items(profile) ? 4 : 0;
}

Lowered lower_tiled(const Problem& problem, const Choices& choices) {
    const std::array<size_t, 2> global{static_cast<size_t>(ceil_divide(problem.output.width, choices.at("PIXELS"))),
                                       static_cast<size_t>(problem.output.height)};
    Lowered lowered = lower(problem, choices, "convolution_tiled", global);
    lowered.packing = packing_in_blocks(problem, choices, "pack_tiled");
    if (choices.contains("HALF")) lowered.packing->call.options = "-DHALF";
    return lowered;
}

// --- direct: register tiles

/// With operands of so many bytes.
std::vector<Choices> register_tiles(const Problem& problem, const DeviceProfile& profile, size_t operand) {
    // At most 24 sums, so that 32 vector registers hold them, the weights and an input; at least 8 to hide latency.
    struct RegisterTile {
        int pixels, group;
    };
    const std::vector<RegisterTile> tiles = blocks_of(problem) == 1 ? std::vector<RegisterTile>{{16, 1}, {20, 1}}
                                                                    : std::vector<RegisterTile>{{12, 2}, {10, 2}};
    const size_t channels = round_up(problem.parameters->in_channels, 4);
    const int margin = problem.parameters->kernel - 1;
    std::vector<Choices> result;
    for (const auto& [pixels_each, group] : tiles) {
        for (const int rows : {4, 2, 1}) {
            if (operand * channels * (rows + margin) * (pixels_each + margin) > profile.local_memory) continue;
            result.push_back({{"PIXELS", pixels_each}, {"ROWS", rows}, {"GROUP", group}});
            break;
        }
    }
    return result;
}

std::vector<Choices> direct_choices(const Problem& problem, const DeviceProfile& profile) {
    return register_tiles(problem, profile, sizeof(float));
}

int prefer_direct(const Problem& problem, const DeviceProfile& profile) {
    const bool fits = is_dense(problem) && !direct_choices(problem, profile).empty();
    return fits && !wants_many_work_items(profile) ? 3 : 0;
}

Lowered lower_direct(const Problem& problem, const Choices& choices) {
    const std::array<size_t, 2> global{static_cast<size_t>(ceil_divide(problem.output.height, choices.at("ROWS"))),
                                       static_cast<size_t>(ceil_divide(problem.output.width, choices.at("PIXELS")))};
    Lowered lowered = lower(problem, choices, "convolution_direct", global);
    lowered.call.row_axis = 0;
    lowered.call.rows_an_item = choices.at("ROWS");
    lowered.packing = packing_in_blocks(problem, choices, "pack_direct");
    return lowered;
}

// --- the same with products of bfloat16

std::vector<Choices> bf16_choices(const Problem& problem, const DeviceProfile& profile) {
    std::vector<Choices> result = register_tiles(problem, profile, sizeof(std::uint16_t));
    for (Choices& choices : result) choices["BF16"] = 1;
    return result;
}

/// Not of layers whose result is rounded next, which are spared Winograd's error as well. Twice as many products as in
/// float are fewer than Winograd's transform saves; and of a few channels too much of a step is empty.
int prefer_bf16(const Problem& problem, const DeviceProfile& profile) {
    const graph::Parameters& parameters = *problem.parameters;
    const bool fits = problem.bf16 && profile.bf16 && is_dense(problem) && !parameters.avoid_winograd &&
                      !bf16_choices(problem, profile).empty();
    const bool pays = parameters.kernel != 3 && parameters.in_channels > 3;
    return !fits ? 0 : pays ? 5 : 2;
}

Lowered lower_bf16(const Problem& problem, const Choices& choices) {
    Lowered lowered = lower_direct(problem, choices);
    const graph::Parameters& parameters = *problem.parameters;
    const int pairs = ceil_divide(parameters.in_channels, 2), out_channels = kBlock * blocks_of(problem);
    lowered.packing =
        packing(problem, choices, "pack_bf16", out_channels, size_t(out_channels) * (1 + parameters.taps() * pairs));
    lowered.packing->call.global[0] = 2 * size_t(pairs);
    return lowered;
}

// --- winograd

/// How convolution_winograd.cl divides the channels.
struct WinogradChannels {
    explicit WinogradChannels(const Problem& problem)
        : input(problem),
          out_blocks(problem.parameters->out_channels / kBlock + (problem.parameters->out_channels % kBlock > 4)),
          out_quad(problem.parameters->out_channels % kBlock > 0 && problem.parameters->out_channels % kBlock <= 4) {}

    size_t packed_floats(int biases) const {
        int quad_vectors = 0;
        for (const InputPart& part : input.parts) quad_vectors += 4 * (part.channels / kBlock) + part.channels % kBlock;
        return biases + 36 * kBlock * (size_t(input.channels) * out_blocks + out_quad * quad_vectors);
    }
    size_t local_bytes(int tiles, int group) const {
        const bool in_place = (out_blocks + group - 1) / group + out_quad == 1 && input.lanes >= kBlock * out_blocks;
        return 36 * sizeof(float) *
               (odd_lines(tiles * input.lanes) + (in_place ? 0 : odd_lines(tiles * kBlock * group)));
    }
    static size_t odd_lines(int floats) { return (floats + 15) / 16 / 2 * 32 + 16; }

    ConvolutionInput input;
    int out_blocks;
    bool out_quad;
};

std::vector<Choices> winograd_choices(const Problem& problem, const DeviceProfile& profile) {
    const WinogradChannels channels(problem);
    std::vector<Choices> result;
    if (problem.parameters->kernel != 3) return result;
    for (const auto& [tiles, most] : {std::pair{8, 2}, {12, 2}, {8, 3}, {4, 1}}) {
        const Choices choice{{"TILES", tiles}, {"GROUP", std::clamp(channels.out_blocks, 1, most)}};
        const bool known = std::find(result.begin(), result.end(), choice) != result.end();
        // Four tiles are too few to hide latency: only for where local memory is small.
        const bool last_resort = tiles == 4 && !result.empty();
        if (!known && !last_resort && channels.local_bytes(tiles, choice.at("GROUP")) <= profile.local_memory)
            result.push_back(choice);
    }
    return result;
}

int prefer_winograd(const Problem& problem, const DeviceProfile& profile) {
    const bool fits =
        is_dense(problem) && !problem.parameters->avoid_winograd && !winograd_choices(problem, profile).empty();
    return fits && !wants_many_work_items(profile) ? 4 : 0;
}

Lowered lower_winograd(const Problem& problem, const Choices& choices) {
    constexpr int kTile = 4;
    const int strips = ceil_divide(ceil_divide(problem.output.width, kTile), choices.at("TILES"));
    Lowered lowered =
        lower(problem, choices, "convolution_winograd",
              {static_cast<size_t>(ceil_divide(problem.output.height, kTile)), static_cast<size_t>(strips)});
    lowered.call.row_axis = 0;
    lowered.call.rows_an_item = kTile;
    const int biases = kBlock * blocks_of(problem);
    lowered.packing =
        packing(problem, choices, "pack_winograd", biases, WinogradChannels(problem).packed_floats(biases));
    return lowered;
}

}  // namespace

std::span<const Implementation> convolution_implementations() {
    static const Implementation implementations[] = {
        {"winograd", prefer_winograd, winograd_choices, lower_winograd},
        {"bf16", prefer_bf16, bf16_choices, lower_bf16},
        {"direct", prefer_direct, direct_choices, lower_direct},
        {"tiled", prefer_tiled, tiled_choices, lower_tiled},
        {"plain", obvious, group_choices, lower_plain},
    };
    return implementations;
}

}  // namespace clarus::runtime
