#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "clarus/device.h"
#include "clarus/stream.h"
#include "graph/graph.h"
#include "runtime/layout.h"

namespace clarus::runtime {

/// Where in a program's result the pipeline's output is that it writes to the caller's image, too, as present() would.
struct Presented {
    int first_channel = 0;
    int channels = 3;    // three colours, and alpha where there are four
    ImageFormat format;  // the caller's, of display-encoded colours
};

/// An operator to be run: its node, the layouts of its inputs and result, and what else its kernels depend on.
struct Problem {
    graph::Node node;
    std::vector<TensorLayout> inputs;
    TensorLayout output;
    const graph::Parameters* parameters = nullptr;  // of a convolution
    std::optional<Presented> presented = {};        // of a pointwise program, whose result is stored as float
    bool bf16 = false;                              // a convolution may multiply in bfloat16
    double operations = 0;
    double bytes = 0;  // its inputs and its result, once each
};

/// What is passed to a kernel, in its order.
enum class ArgumentKind {
    input,            // index: which input of the problem; a buffer
    output,           // a buffer
    packed_weights,   // a buffer of floats: the packed sets of the convolution
    packed_offset,    // uint: where the frame's set begins in it, in floats
    frame,            // struct Frame (kernels/common.clh), by value
    resource,         // index: graph::Resource; the caller's image as a buffer
    resource_offset,  // index: likewise; uint2: bytes to its first pixel, bytes from row to row
    target,           // the caller's output image as a buffer
    target_offset,    // uint2: likewise
    counter,          // a buffer of one uint: the frame's invalid motion vectors
    exposure_image,   // the caller's, as a buffer
    exposure_offset,  // uint2: as resource_offset
    exposure,         // a buffer of floats: the frame's, where a kernel makes it (kernels/exposure.cl)
};
struct Argument {
    ArgumentKind kind;
    int index = 0;
};

/// A tensor under the name that its kernel gives it.
struct NamedTensor {
    std::string name;
    TensorArgument argument;
};

/// A number that follows from sizes or a real scale, under the name that the kernel gives it.
struct NamedNumber {
    std::string name;
    std::variant<std::int32_t, float> value;
};

/// One kernel launch, as data. The kernel has reqd_work_group_size(WG_X, WG_Y, 1); WG_X and WG_Y are set by the runtime
/// from `local`. Where there are tensors, the kernel's first argument is a struct Sizes of them and of the numbers,
/// which the runtime defines and fills in.
struct KernelCall {
    std::string file;    // kernels/<file>.cl; or, where `source` is not empty, a name for messages
    std::string source;  // source made at run time
    std::string entry;
    std::string options;
    std::vector<NamedTensor> tensors;
    std::vector<NamedNumber> numbers;  // none without tensors
    std::vector<Argument> arguments;
    std::array<size_t, 2> global{1, 1};  // rounded up to multiples of `local`
    std::array<size_t, 2> local{1, 1};
    int row_axis = 1;      // along which work-items are one below the other in the result
    int rows_an_item = 1;  // that a work-item makes
};

/// What packing is told of a convolution: struct Shape of kernels/pack.cl, member by member.
struct PackShape {
    std::int32_t in_channels = 0;  // of a group
    std::int32_t out_channels = 0;
    std::int32_t taps = 0;
    std::int32_t group = 1;  // blocks of output channels that are multiplied at once
    std::int32_t parts = 0;
    std::array<std::int32_t, 8> part_channels{};
};
static_assert(sizeof(PackShape) == 52);

/// How a convolution's weights become what its kernel reads: by a kernel of kernels/pack.cl, or on the host, where no
/// weights follow from a frame's jitter.
struct Packing {
    KernelCall call;
    PackShape shape;
    size_t floats = 0;  // of one set, or other numbers of four bytes
    /// In place of `call`: one set.
    std::function<std::vector<std::int32_t>(const graph::Parameters& parameters, int set)> on_host = {};
};

struct Lowered {
    KernelCall call;
    std::optional<Packing> packing;
};

/// Values of what an implementation leaves open ("TILES" → 12).
using Choices = std::map<std::string, int>;

/// Devices that make vectors of work-items, rather than of what a work-item says is one.
inline bool wants_many_work_items(const DeviceProfile& profile) {
    return profile.device_class == DeviceClass::gpu || profile.float_vector_width < 4;
}

/// One way to run an operator. Every operator has an obvious one, which runs everywhere and which the others are tested
/// against.
struct Implementation {
    std::string name;
    /// How well it suits: 0 where it cannot run, 1 for the obvious one, more for better; the built-in choice is the
    /// most.
    std::function<int(const Problem&, const DeviceProfile&)> preference;
    /// Settings to choose from, the built-in one first. At least one.
    std::function<std::vector<Choices>(const Problem&, const DeviceProfile&)> choices;
    std::function<Lowered(const Problem&, const Choices&)> lower;
};

/// All implementations for a node's operator, the obvious one last. Empty for views (concat, slice, …), inputs and
/// states, which launch nothing of their own.
std::span<const Implementation> implementations(const graph::Node& node);

// One function a file of runtime/implementations/.
std::span<const Implementation> convolution_implementations();
std::span<const Implementation> quantized_convolution_implementations();
std::span<const Implementation> upsample_implementations();
std::span<const Implementation> upsample_motion_implementations();
std::span<const Implementation> resample_implementations();
std::span<const Implementation> fit_implementations();
std::span<const Implementation> easu_implementations();
std::span<const Implementation> rcas_implementations();
std::span<const Implementation> dilate_implementations();
std::span<const Implementation> fill_implementations();
std::span<const Implementation> depth_before_implementations();
std::span<const Implementation> previous_depth_implementations();
std::span<const Implementation> checked_motion_implementations();
std::span<const Implementation> validity_implementations();
std::span<const Implementation> reproject_implementations();
std::span<const Implementation> range_implementations();
std::span<const Implementation> believed_implementations();
std::span<const Implementation> landed_source_implementations();
std::span<const Implementation> middle_motion_implementations();
std::span<const Implementation> between_implementations();
std::span<const Implementation> warp_sharply_implementations();
std::span<const Implementation> residual_implementations();
std::span<const Implementation> trust_implementations();
std::span<const Implementation> collect_implementations();
std::span<const Implementation> warp_implementations();
std::span<const Implementation> pick_implementations();
std::span<const Implementation> place_implementations();
std::span<const Implementation> average_pool_implementations();
std::span<const Implementation> sharpen_implementations();
std::span<const Implementation> offset_mask_implementations();
std::span<const Implementation> project_implementations();
std::span<const Implementation> mlaa_implementations();
std::span<const Implementation> radiance_implementations();
std::span<const Implementation> nss_far_implementations();
std::span<const Implementation> nss_scatter_implementations();
std::span<const Implementation> nss_guide_implementations();
std::span<const Implementation> nss_flicker_implementations();
std::span<const Implementation> nss_input_implementations();
std::span<const Implementation> nss_resolve_implementations();
std::span<const Implementation> max_pool_implementations();
std::span<const Implementation> numbers_implementations();
std::span<const Implementation> pointwise_implementations();

}  // namespace clarus::runtime
