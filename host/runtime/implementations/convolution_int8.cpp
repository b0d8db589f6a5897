#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstring>

#include "base/rounding.h"
#include "runtime/bands.h"
#include "runtime/implementations/convolution_input.h"
#include "runtime/implementations/lowering.h"

namespace clarus::runtime {
namespace {

using graph::Convolution;
using graph::Parameters;
using graph::QuantizedWeights;

constexpr int kBlock = 16;       // output channels that are computed as one vector
constexpr int kHead = 16;        // numbers before those of output channels
constexpr int kQuad = 4;         // output channels, where there are no more
constexpr int kMostQuads = 2;    // more are a block
constexpr int kBytesAtOnce = 4;  // input channels that VNNI multiplies in a step

int padded_channels(const Parameters& parameters) { return round_up(parameters.out_channels, kBlock); }

Lowered lower(const Problem& problem, const Choices& choices, std::string file, std::array<size_t, 2> global) {
    const auto& convolution = std::get<Convolution>(problem.node.op);
    Lowered lowered;
    KernelCall& call = lowered.call;
    call.file = std::move(file);
    call.entry = "convolution";
    const ConvolutionInput input(problem);
    call.options = fmt::format("-DCOUT={} -DKERNEL={} -DACTIVATION={}", problem.parameters->out_channels,
                               problem.parameters->kernel, convolution.activation == graph::Activation::relu ? 1 : 0);
    input.describe(call);
    add_tensor(call, "OUT", problem.output);
    for (const Storage storage : {problem.inputs[0].storage, problem.output.storage})
        if (storage == Storage::f16 && call.options.find("STORE_HALF") == std::string::npos)
            call.options += " -DSTORE_HALF";
    if (problem.inputs[0].storage == Storage::u8) call.options += " -DINPUT_BYTES";
    if (convolution.result) call.options += " -DRESULT_BYTES";
    for (const auto& [name, value] : choices)
        if (name != "WG_X" && name != "WG_Y") call.options += fmt::format(" -D{}={}", name, value);
    call.arguments = input.arguments();
    call.arguments.insert(call.arguments.end(),
                          {{ArgumentKind::packed_weights}, {ArgumentKind::output}, {ArgumentKind::packed_offset}});
    call.global = global;
    call.local = choices.contains("WG_X") ? group_size(choices) : std::array<size_t, 2>{1, 1};
    return lowered;
}

/// What kernels/convolution_int8.clh says of a set but for its weights. `bias` of a channel of all sets'.
std::vector<std::int32_t> packed_head(const Convolution& convolution, const Parameters& parameters, int set,
                                      std::int32_t (*bias)(const QuantizedWeights&, size_t channel)) {
    const QuantizedWeights& weights = *parameters.quantized;
    const int padded = padded_channels(parameters);
    std::vector<std::int32_t> packed(kHead + 3 * padded);
    packed[0] = std::bit_cast<std::int32_t>(1 / weights.input.scale);
    packed[1] = weights.input.zero_point;
    if (convolution.result) {
        packed[2] = convolution.result->zero_point;
        packed[3] = convolution.activation == graph::Activation::relu ? convolution.result->zero_point : 0;
    }
    for (int channel = 0; channel < padded; ++channel) {
        const auto put = [&](int array, std::int32_t value) { packed[kHead + array * padded + channel] = value; };
        graph::Requantization unit;
        if (channel < parameters.out_channels) {
            const size_t of_all = static_cast<size_t>(set) * parameters.out_channels + channel;
            put(0, bias(weights, of_all));
            if (convolution.result)
                unit = graph::requantization(graph::requantization_factor(weights, of_all, *convolution.result));
            else
                unit.multiplier = std::bit_cast<std::int32_t>(weights.input.scale * weights.scales[of_all]);
        }
        put(1, unit.multiplier);
        put(2, unit.shift);
    }
    return packed;
}

using PackOne = std::vector<std::int32_t> (*)(const Convolution&, const Parameters&, const Choices&, int set);

Packing packing(const Problem& problem, const Choices& choices, PackOne pack) {
    const Convolution convolution = std::get<Convolution>(problem.node.op);
    Packing result;
    result.on_host = [convolution, choices, pack](const Parameters& parameters, int set) {
        return pack(convolution, parameters, choices, set);
    };
    result.floats = result.on_host(*problem.parameters, 0).size();
    return result;
}

const std::int8_t* weights_of(const Parameters& parameters, int set) {
    return parameters.quantized->weights.data() + set * parameters.weights_per_set();
}

/// Pixels one after another, dense weights, a result for each pixel.
bool is_dense(const Problem& problem) {
    const auto in_pixels = [](const TensorLayout& layout) { return layout.block == 1; };
    return std::all_of(problem.inputs.begin(), problem.inputs.end(), in_pixels) && in_pixels(problem.output) &&
           problem.parameters->groups == 1 && problem.parameters->stride == 1;
}

// --- plain

std::vector<std::int32_t> pack_plain(const Convolution& convolution, const Parameters& parameters, const Choices&,
                                     int set) {
    std::vector<std::int32_t> packed =
        packed_head(convolution, parameters, set,
                    [](const QuantizedWeights& weights, size_t channel) { return weights.biases[channel]; });
    const size_t head = packed.size(), bytes = parameters.weights_per_set();
    packed.resize(head + ceil_divide(static_cast<int>(bytes), 4));
    std::memcpy(&packed[head], weights_of(parameters, set), bytes);
    return packed;
}

Lowered lower_plain(const Problem& problem, const Choices& choices) {
    Lowered lowered = lower(problem, choices, "convolution_int8_plain", pixels(problem.output));
    const Parameters& parameters = *problem.parameters;
    lowered.call.options += fmt::format(" -DGROUPS={} -DSTRIDE={}", parameters.groups, parameters.stride);
    lowered.packing = packing(problem, choices, pack_plain);
    return lowered;
}

/// Of a kernel whose work-items make choices' ROWS rows of `width` pixels.
Lowered lower_strips(const Problem& problem, const Choices& choices, std::string file, int width) {
    const int rows = choices.at("ROWS");
    Lowered lowered = lower(problem, choices, std::move(file),
                            {static_cast<size_t>(ceil_divide(problem.output.height, rows)),
                             static_cast<size_t>(ceil_divide(problem.output.width, width))});
    lowered.call.row_axis = 0;
    lowered.call.rows_an_item = rows;
    return lowered;
}

// --- tiled: staged in local memory by many work-items

std::vector<std::int32_t> pack_tiled(const Convolution& convolution, const Parameters& parameters, const Choices&,
                                     int set) {
    std::vector<std::int32_t> packed = packed_head(convolution, parameters, set, graph::centred_bias);
    const size_t head = packed.size();
    const int taps = parameters.taps(), fours = ceil_divide(parameters.in_channels, kBytesAtOnce);
    packed.resize(head + size_t(padded_channels(parameters)) * fours * taps);
    auto* bytes = reinterpret_cast<std::int8_t*>(&packed[head]);
    const std::int8_t* weight = weights_of(parameters, set);
    for (int out = 0; out < parameters.out_channels; ++out) {
        for (int in = 0; in < parameters.in_channels; ++in) {
            for (int tap = 0; tap < taps; ++tap, ++weight) {
                const size_t vector = size_t(out / kBlock * fours + in / kBytesAtOnce) * taps + tap;
                bytes[(vector * kBlock + out % kBlock) * kBytesAtOnce + in % kBytesAtOnce] = *weight;
            }
        }
    }
    return packed;
}

std::vector<Choices> tiled_choices(const Problem& problem, const DeviceProfile& profile) {
    constexpr int kChunk = 16, kPixels = 4;
    const int margin = problem.parameters->kernel - 1;
    std::vector<Choices> result;
    for (const auto& [width, height] : {std::pair{16, 8}, {32, 4}, {8, 8}}) {
        const size_t patch = size_t(kChunk) * (width * kPixels + margin) * (height + margin);
        const size_t work_items = static_cast<size_t>(width) * height;
        if (patch > profile.local_memory || work_items > profile.max_work_group_size) continue;
        result.push_back({{"WG_X", width}, {"WG_Y", height}, {"PIXELS", kPixels}, {"CHUNK", kChunk}});
        if (profile.int8_dot_product) result.back()["DOT"] = 1;
    }
    return result;
}

int prefer_tiled(const Problem& problem, const DeviceProfile& profile) {
    const bool fits = is_dense(problem) && !tiled_choices(problem, profile).empty();
    return fits && wants_many_work_items(profile) ? 3 : 0;
}

Lowered lower_tiled(const Problem& problem, const Choices& choices) {
    const std::array<size_t, 2> global{static_cast<size_t>(ceil_divide(problem.output.width, choices.at("PIXELS"))),
                                       static_cast<size_t>(problem.output.height)};
    Lowered lowered = lower(problem, choices, "convolution_int8_tiled", global);
    lowered.packing = packing(problem, choices, pack_tiled);
    return lowered;
}

// --- streamed through a small scratch memory by few work-items

std::vector<std::int32_t> pack_streamed(const Convolution& convolution, const Parameters& parameters, const Choices&,
                                        int set) {
    std::vector<std::int32_t> packed = packed_head(convolution, parameters, set, graph::centred_bias);
    const size_t head = packed.size();
    const int taps = parameters.taps(), channels = parameters.in_channels;
    packed.resize(head + size_t(padded_channels(parameters)) * taps * channels / 4);
    auto* bytes = reinterpret_cast<std::int8_t*>(&packed[head]);
    const std::int8_t* weight = weights_of(parameters, set);
    for (int out = 0; out < parameters.out_channels; ++out)
        for (int in = 0; in < channels; ++in)
            for (int tap = 0; tap < taps; ++tap, ++weight)
                bytes[(size_t(out / kBlock * taps + tap) * channels + in) * kBlock + out % kBlock] = *weight;
    return packed;
}

std::vector<Choices> streamed_choices(const Problem& problem, const DeviceProfile& profile) {
    constexpr int kPixels = 4;
    const int kernel = problem.parameters->kernel, rows = band_granule(profile);  // more do not work on bands
    const TensorLayout& input = problem.inputs[0];
    const int pixel = input.storage == Storage::u8 ? input.stride : round_up(problem.parameters->in_channels, 4);
    std::vector<Choices> result;
    for (const int width : {64, 32, 16, 8}) {
        const size_t line = size_t(pixel) * (width + kernel - 1 + kPixels);
        if (line * (kernel + 1) > profile.local_memory) continue;
        result.push_back({{"WIDTH", width}, {"ROWS", rows}, {"PIXELS", kPixels}});
    }
    return result;
}

/// VNNI's products are faster on what has them, whatever it is taken for.
int prefer_streamed(const Problem& problem, const DeviceProfile& profile) {
    const bool fits = is_dense(problem) && !streamed_choices(problem, profile).empty();
    if (!fits || profile.device_class != DeviceClass::dsp) return 0;
    return profile.vnni ? 2 : 4;
}

Lowered lower_streamed(const Problem& problem, const Choices& choices) {
    Lowered lowered = lower_strips(problem, choices, "convolution_int8_streamed", choices.at("WIDTH"));
    lowered.packing = packing(problem, choices, pack_streamed);
    return lowered;
}

// --- register tiles

/// What of a layer's output channels is computed in blocks, and what by VNNI in vectors of sixteen input channels.
struct Tiles {
    Tiles(const Parameters& parameters, const Choices& choices)
        : vnni(choices.contains("VNNI")),
          group(choices.at("GROUP")),
          quads(vnni ? quads_of(parameters) : 0),
          blocks(quads > 0 ? parameters.out_channels / kBlock : padded_channels(parameters) / kBlock),
          taps(parameters.taps()),
          steps(ceil_divide(parameters.in_channels, vnni ? kBytesAtOnce : 1)),
          wide_steps(ceil_divide(parameters.in_channels, kBlock)) {}

    /// Where they take fewer steps than one more block.
    static int quads_of(const Parameters& parameters) {
        const int quads = ceil_divide(parameters.out_channels % kBlock, kQuad);
        const bool pays =
            quads * ceil_divide(parameters.in_channels, kBlock) < ceil_divide(parameters.in_channels, kBytesAtOnce);
        return quads <= kMostQuads && pays ? quads : 0;
    }

    size_t quads_begin() const { return size_t(blocks) * kBlock * taps * steps; }  // in numbers of four bytes
    size_t size() const { return quads_begin() + size_t(quads) * kBlock * taps * wide_steps; }

    /// Where a weight of an output channel in a block is, among all such; `at_once` of them follow each other.
    size_t in_block(int out, int in, int tap) const {
        const int first = out / kBlock / group * group, width = kBlock * std::min(group, blocks - first);
        const int at_once = vnni ? kBytesAtOnce : 1;
        const size_t vector =
            size_t(first) * kBlock * taps * steps + size_t(tap * steps + in / at_once) * width + out - first * kBlock;
        return vector * at_once + in % at_once;
    }
    /// Of one in a quad, in bytes.
    size_t in_quad(int out, int in, int tap) const {
        const int rest = out - blocks * kBlock;
        const size_t vector = size_t(rest / kQuad * taps + tap) * wide_steps + in / kBlock;
        return quads_begin() * kBytesAtOnce + (vector * kQuad + rest % kQuad) * kBlock + in % kBlock;
    }

    bool vnni;
    int group, quads, blocks, taps, steps, wide_steps;
};

std::vector<std::int32_t> pack_tiles(const Convolution& convolution, const Parameters& parameters,
                                     const Choices& choices, int set) {
    std::vector<std::int32_t> packed = packed_head(convolution, parameters, set, graph::centred_bias);
    const size_t head = packed.size();
    const Tiles tiles(parameters, choices);
    packed.resize(head + tiles.size());
    auto* bytes = reinterpret_cast<std::int8_t*>(&packed[head]);
    const std::int8_t* weight = weights_of(parameters, set);
    for (int out = 0; out < parameters.out_channels; ++out) {
        for (int in = 0; in < parameters.in_channels; ++in) {
            for (int tap = 0; tap < parameters.taps(); ++tap, ++weight) {
                if (out >= tiles.blocks * kBlock)
                    bytes[tiles.in_quad(out, in, tap)] = *weight;
                else if (tiles.vnni)
                    bytes[tiles.in_block(out, in, tap)] = *weight;
                else
                    packed[head + tiles.in_block(out, in, tap)] =
                        std::bit_cast<std::int32_t>(static_cast<float>(*weight));
            }
        }
    }
    return packed;
}

/// Whether no sum reaches what a float counts to.
bool is_exact_in_float(const Problem& problem) {
    constexpr double kWholeFloats = 1 << 24;
    const QuantizedWeights& weights = *problem.parameters->quantized;
    for (size_t channel = 0; channel < weights.scales.size(); ++channel)
        if (graph::largest_sum(weights, channel) > kWholeFloats) return false;
    return true;
}

std::vector<Choices> tile_choices(const Problem& problem, const DeviceProfile& profile, size_t operand, bool vnni) {
    struct RegisterTile {
        int pixels, group;
    };
    // 32 vector registers hold the sums, the weights and an input.
    const int blocks = padded_channels(*problem.parameters) / kBlock;
    const bool one_block = blocks == 1 || (vnni && blocks == 2 && Tiles::quads_of(*problem.parameters) > 0);
    const bool two_quads = vnni && Tiles::quads_of(*problem.parameters) > 1;
    const std::vector<RegisterTile> tiles = !one_block  ? std::vector<RegisterTile>{{12, 2}, {8, 3}}
                                            : two_quads ? std::vector<RegisterTile>{{12, 1}, {8, 1}}
                                                        : std::vector<RegisterTile>{{24, 1}, {16, 1}};
    const size_t channels = round_up(problem.parameters->in_channels, kBlock);
    const int margin = problem.parameters->kernel - 1;
    std::vector<Choices> result;
    for (const auto& [pixels_each, group] : tiles) {
        for (const int rows : {4, 2, 1}) {
            if (operand * channels * (rows + margin) * (pixels_each + margin) > profile.local_memory) continue;
            Choices choices{{"PIXELS", pixels_each}, {"ROWS", rows}, {"GROUP", group}};
            if (vnni) choices["VNNI"] = 1;
            result.push_back(std::move(choices));
            break;
        }
    }
    return result;
}

std::vector<Choices> vnni_choices(const Problem& problem, const DeviceProfile& profile) {
    return tile_choices(problem, profile, sizeof(std::uint8_t), true);
}

std::vector<Choices> exact_choices(const Problem& problem, const DeviceProfile& profile) {
    return tile_choices(problem, profile, sizeof(float), false);
}

int prefer_vnni(const Problem& problem, const DeviceProfile& profile) {
    return profile.vnni && is_dense(problem) && !vnni_choices(problem, profile).empty() ? 3 : 0;
}

int prefer_exact(const Problem& problem, const DeviceProfile& profile) {
    const bool fits = is_dense(problem) && is_exact_in_float(problem) && !exact_choices(problem, profile).empty();
    return fits && !wants_many_work_items(profile) ? 2 : 0;
}

Lowered lower_tiles(const Problem& problem, const Choices& choices) {
    Lowered lowered = lower_strips(problem, choices, "convolution_int8", choices.at("PIXELS"));
    lowered.call.options += fmt::format(" -DQUADS={}", Tiles(*problem.parameters, choices).quads);
    lowered.packing = packing(problem, choices, pack_tiles);
    return lowered;
}

}  // namespace

std::span<const Implementation> quantized_convolution_implementations() {
    static const Implementation implementations[] = {
        {"int8 by VNNI", prefer_vnni, vnni_choices, lower_tiles},
        {"int8 tiled", prefer_tiled, tiled_choices, lower_tiled},
        {"int8 streamed", prefer_streamed, streamed_choices, lower_streamed},
        {"int8 in float", prefer_exact, exact_choices, lower_tiles},
        {"int8", obvious, group_choices, lower_plain},
    };
    return implementations;
}

}  // namespace clarus::runtime
