#include "runtime/implementations/lowering.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <stdexcept>

namespace clarus::runtime {
namespace {

std::string upper_case(std::string name) {
    for (char& c : name) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    return name;
}

}  // namespace

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

void add_number(KernelCall& call, const std::string& name, std::variant<std::int32_t, float> value) {
    call.options += fmt::format(" -D{}=sizes->{}", upper_case(name), name);
    call.numbers.push_back({name, value});
}

void add_scale(KernelCall& call, double scale, const std::string& axis) {
    const auto nearest = static_cast<float>(scale);
    add_number(call, "scale" + axis, nearest);
    add_number(call, "scale" + axis + "_rest", static_cast<float>(scale - nearest));
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

void add_span(KernelCall& call, const std::string& name, int pixels, double scale, int taps) {
    // Whole parts of two coordinates are no farther apart than these are, rounded up; or one more by rounding errors.
    const auto span = [&](double at_scale) { return static_cast<int>(std::ceil((pixels - 1) / at_scale)) + 1 + taps; };
    add_number(call, name, span(scale));
    call.options += fmt::format(" -DMOST_{}={}", upper_case(name), span(1));
}

Lowered in_strips(Lowered plain, const Problem& problem, int width, int height) {
    plain.call.entry += "_strip";
    plain.call.options += fmt::format(" -DPIXELS={} -DROWS={}", width, height);
    plain.call.global = strips(problem.output, width, height);
    return plain;
}

int prefer_not_on_gpus(const Problem&, const DeviceProfile& profile) {
    return profile.device_class != DeviceClass::gpu ? 2 : 0;
}

int prefer_strips_of_quads(const Problem& problem, const DeviceProfile& profile) {
    const int channels = problem.inputs[0].channels;
    const bool fits = (channels == 1 || channels == 3) && has_quads(problem.inputs[0]) && problem.output.block == 1;
    return fits ? prefer_not_on_gpus(problem, profile) : 0;
}

int prefer_sample_lanes(const Problem& problem, const DeviceProfile& profile) {
    const bool fits = problem.output.block == 1 && std::all_of(problem.inputs.begin(), problem.inputs.end(),
                                                               [](const TensorLayout& in) { return in.block == 1; });
    return fits && !wants_many_work_items(profile) ? 2 : 0;
}

Lowered in_sample_lanes(Lowered plain, const Problem& problem, double scale) {
    constexpr int kLanes = 16, kRows = 16;
    constexpr int kMostPhases = 8;  // more pixels of a sample are made one by one
    plain.call.entry += "_lanes";
    plain.call.options += fmt::format(" -DROWS={} -DMOST_PHASES={}", kRows, kMostPhases);
    add_number(plain.call, "phases", static_cast<int>(std::min<double>(std::ceil(scale), kMostPhases)));
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
        default:
            throw std::logic_error("an element type that is not written");
    }
}

int obvious(const Problem&, const DeviceProfile&) { return 1; }

}  // namespace clarus::runtime
