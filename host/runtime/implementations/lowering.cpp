#include "runtime/implementations/lowering.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace clarus::runtime {

void add_tensor(KernelCall& call, const std::string& name, const TensorLayout& layout) {
    call.options += fmt::format(" {}", layout_options(name, layout));
    call.tensors.push_back({name, argument_for(layout)});
}

void add_images(KernelCall& call, std::initializer_list<NamedLayout> images) {
    const Storage storage = images.begin()->layout.storage;
    for (const NamedLayout& image : images) {
        if (image.layout.storage != storage) throw std::logic_error("a kernel's images have one storage");
        add_tensor(call, std::string(image.name), image.layout);
    }
    if (storage == Storage::f16) call.options += " -DSTORE_HALF";
}

std::string shift_options(graph::Shift shift) {
    switch (shift) {
        case graph::Shift::none:
            return "-DSHIFT_X=0.0f -DSHIFT_Y=0.0f";
        case graph::Shift::jitter:
            return "-DSHIFT_X=frame.jitter_x -DSHIFT_Y=frame.jitter_y";
        case graph::Shift::motion_jitter:
            return "-DSHIFT_X=frame.motion_jitter_x -DSHIFT_Y=frame.motion_jitter_y";
    }
    throw std::logic_error("unknown shift");
}

std::string scale_options(double scale, std::string_view axis) {
    const auto nearest = static_cast<float>(scale);
    return fmt::format("-DSCALE{0}={1:.9e}f -DSCALE{0}_REST={2:.9e}f", axis, nearest, scale - nearest);
}

std::vector<Choices> group_choices(const Problem&, const DeviceProfile& profile) {
    const auto group = [](int x, int y) { return Choices{{"WG_X", x}, {"WG_Y", y}}; };
    // A CPU runs a group as a loop along the row in one thread.
    if (profile.device_class != DeviceClass::gpu) return {group(64, 1)};
    return {group(16, 8), group(32, 4), group(64, 1)};
}

std::vector<Choices> single_choices(const Problem&, const DeviceProfile&) { return {{{"WG_X", 1}, {"WG_Y", 1}}}; }

std::vector<Choices> strip_choices(const Problem& problem, const DeviceProfile& profile) {
    std::vector<Choices> result = group_choices(problem, profile);
    for (Choices& choices : result) choices["STRIP"] = 1;
    // Vectors that the kernel says itself are better than those of work-items whose pixels lie channels apart.
    if (!wants_many_work_items(profile)) result.insert(result.begin(), {{"WG_X", 1}, {"WG_Y", 1}, {"STRIP", 64}});
    return result;
}

std::array<size_t, 2> strips(const TensorLayout& layout, const Choices& choices) {
    return strips(layout, choices.at("STRIP"), 1);
}

std::array<size_t, 2> group_size(const Choices& choices) {
    return {static_cast<size_t>(choices.at("WG_X")), static_cast<size_t>(choices.at("WG_Y"))};
}

std::array<size_t, 2> pixels(const TensorLayout& layout) {
    return {static_cast<size_t>(layout.width), static_cast<size_t>(layout.height)};
}

std::array<size_t, 2> strips(const TensorLayout& layout, int width, int height) {
    return {static_cast<size_t>((layout.width + width - 1) / width),
            static_cast<size_t>((layout.height + height - 1) / height)};
}

int source_span(int pixels, double scale, int taps) {
    // Whole parts of two coordinates are no farther apart than these are, rounded up; or one more by rounding errors.
    return static_cast<int>(std::ceil((pixels - 1) / scale)) + 1 + taps;
}

int prefer_source_strips(const Problem&, const DeviceProfile& profile) {
    return profile.device_class != DeviceClass::gpu ? 2 : 0;
}

Lowered in_source_strips(Lowered plain, const Problem& problem, double scale, int taps) {
    constexpr int kPixels = 256, kRows = 8;  // wide, so that memory is read and written in long runs
    plain.call.entry += "_strip";
    plain.call.options +=
        fmt::format(" -DPIXELS={} -DROWS={} -DSPAN={}", kPixels, kRows, source_span(kPixels, scale, taps));
    plain.call.global = strips(problem.output, kPixels, kRows);
    return plain;
}

int prefer_sample_lanes(const Problem& problem, const DeviceProfile& profile) {
    const bool fits = problem.output.block == 1 && std::all_of(problem.inputs.begin(), problem.inputs.end(),
                                                               [](const TensorLayout& in) { return in.block == 1; });
    return fits && !wants_many_work_items(profile) ? 2 : 0;
}

Lowered in_sample_lanes(Lowered plain, const Problem& problem, double scale) {
    constexpr int kLanes = 16, kRows = 16;
    plain.call.entry += "_lanes";
    plain.call.options += fmt::format(" -DROWS={} -DPHASES={}", kRows, static_cast<int>(std::ceil(scale)));
    plain.call.global = strips(problem.inputs[0], kLanes, kRows);
    return plain;
}

bool has_quads(const TensorLayout& layout) { return layout.block == 1 && layout.stride == 4; }

std::string_view opencl_type(ElementType type) {
    switch (type) {
        case ElementType::u8:
            return "uchar";
        case ElementType::f16:
            return "half";
        case ElementType::f32:
            return "float";
    }
    throw std::logic_error("unknown element type");
}

int obvious(const Problem&, const DeviceProfile&) { return 1; }

}  // namespace clarus::runtime
