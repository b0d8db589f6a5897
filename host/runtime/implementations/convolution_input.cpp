#include "runtime/implementations/convolution_input.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <string_view>

#include "runtime/implementations/lowering.h"

namespace clarus::runtime {
namespace {

using graph::Reading;

std::string_view name_of(const InputPart& part, const TensorLayout& image) {
    switch (part.reading) {
        case Reading::whole:
            return image.samples > 1 ? "SAMPLES" : part.factor >= 0 ? "WEIGHTED" : "WHOLE";
        case Reading::pooled:
            return "POOLED";
        case Reading::upsampled:
            return "UPSAMPLED";
        case Reading::factor:
            break;
    }
    throw std::logic_error("a factor is no part of its own");
}

const graph::Convolution& convolution_of(const Problem& problem) {
    return std::get<graph::Convolution>(problem.node.op);
}

/// Of all that it reads: that of its result, unless it is one in whole numbers, whose result may be in bytes.
Storage images_storage(const Problem& problem) {
    return convolution_of(problem).rounds ? problem.inputs[0].storage : problem.output.storage;
}

/// Lanes that so many channels take.
int lanes_of(int channels) {
    const int rest = channels % 16;
    return channels - rest + (rest > 8 ? 16 : rest > 4 ? 8 : rest > 0 ? 4 : 0);
}

}  // namespace

ConvolutionInput::ConvolutionInput(const Problem& problem) : problem_(problem) {
    const std::vector<Reading>& readings = convolution_of(problem).readings;
    for (int input = 0; input < static_cast<int>(problem.inputs.size()); ++input) {
        const TensorLayout& layout = problem.inputs[input];
        const Reading reading = readings.empty() ? Reading::whole : readings.at(input);
        if (layout.storage != images_storage(problem)) throw std::logic_error("a kernel's images have one storage");
        if (reading == Reading::factor) {
            parts.at(parts.size() - 1).factor = input;
        } else {
            parts.push_back({reading, input, channels, layout.channels, lanes});
            channels += layout.channels;
            lanes += lanes_of(layout.channels);
        }
    }
}

void ConvolutionInput::describe(KernelCall& call) const {
    const graph::Convolution& convolution = convolution_of(problem_);
    // The input as a whole has a size, and no memory of its own.
    const TensorLayout& first = problem_.inputs[0];
    const int width = convolution.readings.empty() ? first.width : convolution.width;
    const int height = convolution.readings.empty() ? first.height : convolution.height;
    call.tensors.push_back({"IN", {width, height, 0, 0, 0, 0}});
    TensorArgument common{width, height, 0, 0, 0, 0};
    for (size_t i = 0; i < problem_.inputs.size(); ++i) {
        const Reading reading = convolution.readings.empty() ? Reading::whole : convolution.readings[i];
        if (reading == Reading::pooled || reading == Reading::upsampled) continue;
        common.width = std::min(common.width, problem_.inputs[i].width);
        common.height = std::min(common.height, problem_.inputs[i].height);
    }
    call.tensors.push_back({"COMMON", common});
    call.options += fmt::format(
        " -DCIN={} -DPARTS={} -DLANES={} -DIN_WIDTH=sizes->IN.width -DIN_HEIGHT=sizes->IN.height "
        "-DCOMMON_WIDTH=sizes->COMMON.width -DCOMMON_HEIGHT=sizes->COMMON.height",
        channels, parts.size(), lanes);
    int dense = channels;
    for (size_t i = 0; i < parts.size(); ++i) {
        const InputPart& part = parts[i];
        const TensorLayout& image = problem_.inputs[part.image];
        call.options += fmt::format(" -DPART{0}_READING={1} -DPART{0}_FIRST={2} -DPART{0}_LANE={3}", i,
                                    name_of(part, image), part.first, part.lane);
        add_tensor(call, fmt::format("PART{}", i), image);
        if (part.factor >= 0) add_tensor(call, fmt::format("FACTOR{}", i), problem_.inputs[part.factor]);
        if (image.samples == 1) continue;
        call.options += fmt::format(" -DPART{0}_SCALE={1} -DSAMPLES_PART={0}", i, image.samples);
        dense = part.first;
    }
    call.options += fmt::format(" -DDENSE_CIN={}", dense);
}

std::vector<Argument> ConvolutionInput::arguments() const {
    std::vector<Argument> result;
    for (const InputPart& part : parts) {
        result.push_back({ArgumentKind::input, part.image});
        if (part.factor >= 0) result.push_back({ArgumentKind::input, part.factor});
        if (problem_.inputs[part.image].samples > 1) result.push_back({ArgumentKind::frame});
    }
    return result;
}

}  // namespace clarus::runtime
