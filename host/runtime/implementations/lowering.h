#pragma once

#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/implementation.h"

namespace clarus::runtime {

// What the operators between the convolutions share when they are lowered.

struct NamedLayout {
    std::string_view name;
    const TensorLayout& layout;
};
/// Tells the call's kernel of images of one storage: their layouts, and STORE_HALF where that is half.
void add_images(KernelCall& call, std::initializer_list<NamedLayout> images);
/// The same of one tensor, whose storage the kernel knows.
void add_tensor(KernelCall& call, const std::string& name, const TensorLayout& layout);

/// SHIFT_X and SHIFT_Y: the jitter as expressions in the kernel's `frame`.
std::string shift_options(graph::Shift shift);
/// Tells the call's kernel of a number when it runs, as NAME for `name`.
void add_number(KernelCall& call, const std::string& name, std::variant<std::int32_t, float> value);
/// SCALE and SCALE_REST: a real scale as the sum of two floats. Of one axis alone: SCALE_X, SCALE_X_REST.
void add_scale(KernelCall& call, double scale, const std::string& axis = "");

/// "WG_X" and "WG_Y": work-groups that suit the device, the built-in one first.
std::vector<Choices> group_choices(const Problem& problem, const DeviceProfile& profile);
std::array<size_t, 2> group_size(const Choices& choices);

/// One-item groups, for kernels that say themselves what is a vector.
std::vector<Choices> single_choices(const Problem& problem, const DeviceProfile& profile);

/// "WG_X", "WG_Y" and "STRIP", the pixels of a row that a work-item makes, for kernels whose vectors are a pixel's
/// channels.
std::vector<Choices> strip_choices(const Problem& problem, const DeviceProfile& profile);
std::array<size_t, 2> strips(const TensorLayout& layout, const Choices& choices);

/// A work-item for each pixel.
std::array<size_t, 2> pixels(const TensorLayout& layout);
/// A work-item for each strip of so many pixels.
std::array<size_t, 2> strips(const TensorLayout& layout, int width, int height);

/// The source pixels that so many of an image `scale` >= 1 times as large are over, along an axis, and the `taps`
/// around each: NAME for `name`, at most MOST_NAME.
void add_span(KernelCall& call, const std::string& name, int pixels, double scale, int taps);

/// An operator's kernel ENTRY_strip, of the same arguments, for devices that are not GPUs: a work-item makes
/// PIXELS × ROWS pixels.
Lowered in_strips(Lowered plain, const Problem& problem, int width, int height);
int prefer_not_on_gpus(const Problem& problem, const DeviceProfile& profile);
/// The same where the kernel wants an input of three channels in pixels of four elements, and a result of one block.
int prefer_strips_of_quads(const Problem& problem, const DeviceProfile& profile);

/// An operator whose output pixels each look at the samples around their nearest one of inputs[0], all pixels of
/// sixteen samples side by side as vectors: the kernel ENTRY_lanes of the same arguments, with ROWS of samples, PHASES
/// and MOST_PHASES (kernels/sample_lanes.clh).
int prefer_sample_lanes(const Problem& problem, const DeviceProfile& profile);
Lowered in_sample_lanes(Lowered plain, const Problem& problem, double scale);

/// The OpenCL type of the caller's elements.
std::string_view opencl_type(ElementType type);

/// Whether pixels are four elements one after another.
bool has_quads(const TensorLayout& layout);

/// The preference of an implementation that runs everywhere.
int obvious(const Problem& problem, const DeviceProfile& profile);

}  // namespace clarus::runtime
