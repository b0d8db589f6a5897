#include <fmt/format.h>

#include "runtime/implementations/lowering.h"
#include "runtime/inputs.h"

namespace clarus::runtime {

KernelCall present(const TensorLayout& output, const StreamOptions& options) {
    const ImageFormat& format = options.output_format;
    KernelCall call;
    call.file = call.entry = "present";
    call.options = fmt::format("-DTARGET={} -DTARGET_COMPONENTS={}{}", opencl_type(format.type), format.channels,
                               options.color_space == ColorSpace::linear ? " -DLINEAR_COLOR" : "");
    add_images(call, {{"OUT", output}});
    call.arguments = {{ArgumentKind::input, 0}, {ArgumentKind::target}, {ArgumentKind::target_offset}};
    if (computes_exposure(options)) {
        call.options += " -DEXPOSURE_COMPUTED";
        call.arguments.push_back({ArgumentKind::exposure});
    }
    call.arguments.push_back({ArgumentKind::frame});
    call.global = pixels(output);
    call.global[0] = (call.global[0] + 3) / 4;
    call.local = {64, 1};
    return call;
}

}  // namespace clarus::runtime
