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
/// SCALE and SCALE_REST: a real scale as the sum of two floats. Of one axis alone: SCALE_X, SCALE_X_REST.
std::string scale_options(double scale, std::string_view axis = "");

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

/// The most source pixels under so many of an image `scale` times as large and the taps around each.
int source_span(int pixels, double scale, int taps);

/// An operator whose output pixels each look at `taps` source pixels along an axis, as strips for devices that are not
/// GPUs: the kernel ENTRY_strip of the same arguments, with PIXELS, ROWS and SPAN (a strip's source pixels along x).
int prefer_source_strips(const Problem& problem, const DeviceProfile& profile);
Lowered in_source_strips(Lowered plain, const Problem& problem, double scale, int taps);

/// An operator whose output pixels each look at the samples around their nearest one of inputs[0], all pixels of
/// sixteen samples side by side as vectors: the kernel ENTRY_lanes of the same arguments, with ROWS of samples and
/// PHASES (kernels/sample_lanes.clh).
int prefer_sample_lanes(const Problem& problem, const DeviceProfile& profile);
Lowered in_sample_lanes(Lowered plain, const Problem& problem, double scale);

/// The OpenCL type of the caller's elements.
std::string_view opencl_type(ElementType type);

/// Whether pixels are four elements one after another.
bool has_quads(const TensorLayout& layout);

/// The preference of an implementation that runs everywhere.
int obvious(const Problem& problem, const DeviceProfile& profile);

}  // namespace clarus::runtime
