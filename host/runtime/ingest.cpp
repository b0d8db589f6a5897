#include <fmt/format.h>

#include <stdexcept>
#include <string_view>

#include "base/image_format.h"
#include "runtime/implementations/lowering.h"
#include "runtime/inputs.h"

namespace clarus::runtime {
namespace {

std::string source_options(std::string_view name, const ImageFormat& format) {
    return fmt::format(" -DRAW_{0}={1} -DRAW_{0}_COMPONENTS={2}", name, element_name(format.type), format.channels);
}

}  // namespace

KernelCall ingest(const IngestProblem& problem) {
    const StreamOptions& options = *problem.options;
    KernelCall call;
    call.file = call.entry = "ingest";

    const TensorLayout *widest = nullptr, *highest = nullptr;
    std::string_view widest_name, highest_name;
    const auto destination = [&](std::string_view name, const std::optional<TensorLayout>& layout, int index) {
        if (!layout) return;
        add_tensor(call, std::string(name), *layout);
        call.options += fmt::format(" -D{}_STORAGE={}", name, layout->storage == Storage::f16 ? "half" : "float");
        call.arguments.push_back({ArgumentKind::input, index});
        if (!widest || layout->width > widest->width) widest = &*layout, widest_name = name;
        if (!highest || layout->height > highest->height) highest = &*layout, highest_name = name;
    };
    const auto resource = [&](std::string_view name, const std::optional<TensorLayout>& layout, graph::Resource source,
                              const std::optional<ImageFormat>& format, int written) {
        if (!layout) return;
        const int index = static_cast<int>(source);
        call.options += source_options(name, format.value());
        call.arguments.push_back({ArgumentKind::resource, index});
        call.arguments.push_back({ArgumentKind::resource_offset, index});
        destination(name, layout, written);
    };

    using graph::Resource;
    resource("COLOR", problem.color, Resource::color, options.color_format, 0);
    resource("DEPTH", problem.depth, Resource::depth, options.depth_format, 1);
    resource("MOTION", problem.motion, Resource::motion, options.motion_format, 2);
    if (problem.motion) call.arguments.push_back({ArgumentKind::counter});
    destination("JITTER_X", problem.jitter_x, 3);
    destination("JITTER_Y", problem.jitter_y, 4);
    destination("SCALE", problem.scale, 5);
    resource("REACTIVE", problem.reactive_mask, Resource::reactive_mask, options.reactive_format, 6);
    resource("TRANSPARENCY", problem.transparency_mask, Resource::transparency_mask, options.transparency_format, 7);
    resource("OPAQUE", problem.opaque_color, Resource::opaque_color, options.opaque_format, 8);
    resource("UI", problem.ui, Resource::ui, options.ui_format, 9);
    resource("ALPHA", problem.alpha, Resource::alpha, options.color_format, 10);
    if (computes_exposure(options)) {
        call.options += " -DEXPOSURE_COMPUTED";
        call.arguments.push_back({ArgumentKind::exposure});
    }
    call.arguments.push_back({ArgumentKind::frame});
    if (!widest) throw std::logic_error("a pipeline reads something of its frame");

    call.options += fmt::format(" -DWIDTH={}_WIDTH -DHEIGHT={}_HEIGHT", widest_name, highest_name);
    for (const auto& [name, tensor] : call.tensors)
        call.options += fmt::format(" -D{}_SMALLER={}", name,
                                    tensor.width < widest->width || tensor.height < highest->height ? 1 : 0);
    if (options.color_space == ColorSpace::linear) call.options += " -DLINEAR_COLOR";
    if (options.depth.projective) call.options += " -DPROJECTIVE_DEPTH";
    if (options.depth.reversed) call.options += " -DREVERSED_DEPTH";
    call.global = {(pixels(*widest)[0] + 3) / 4, pixels(*highest)[1]};
    call.local = {64, 1};
    return call;
}

KernelCall exposure(const IngestProblem& problem) {
    const StreamOptions& options = *problem.options;
    KernelCall call;
    call.file = "exposure";
    call.entry = "make_exposure";
    if (options.automatic_exposure) {
        add_tensor(call, "COLOR", problem.color.value());
        call.options += fmt::format("{} -DAUTOMATIC -DMOST_SAMPLES={}", source_options("COLOR", options.color_format),
                                    kExposureSamples);
        constexpr int color = static_cast<int>(graph::Resource::color);
        call.arguments = {{ArgumentKind::resource, color}, {ArgumentKind::resource_offset, color}};
    } else {
        call.options += source_options("EXPOSURE", options.exposure_format.value());
        call.arguments = {{ArgumentKind::exposure_image}, {ArgumentKind::exposure_offset}};
    }
    call.arguments.push_back({ArgumentKind::exposure});
    call.arguments.push_back({ArgumentKind::frame});
    call.global = call.local = {64, 1};
    return call;
}

}  // namespace clarus::runtime
