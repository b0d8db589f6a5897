#pragma once

#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/implementation.h"

namespace clarus::runtime {

/// What operators that run one work-item a pixel (or cell, or block) share.

/// The layouts as options, and STORE_HALF where these images are stored in half. They have one storage.
struct NamedLayout {
    std::string_view name;
    const TensorLayout& layout;
};
std::string image_options(std::initializer_list<NamedLayout> images);

/// "WG_X" and "WG_Y": work-groups that suit the device, the built-in one first.
std::vector<Choices> group_choices(const Problem& problem, const DeviceProfile& profile);
std::array<size_t, 2> group_size(const Choices& choices);

/// A work-item for each pixel.
std::array<size_t, 2> pixels(const TensorLayout& layout);

/// The OpenCL type of the caller's elements.
std::string_view opencl_type(ElementType type);

/// One that runs everywhere.
int obvious(const Problem& problem, const DeviceProfile& profile);

}  // namespace clarus::runtime
