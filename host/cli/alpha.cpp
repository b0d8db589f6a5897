#include "cli/alpha.h"

#include <algorithm>

#include "cli/frame_description.h"
#include "cli/model_choice.h"

namespace clarus::cli {
namespace {

UpscalerOptions options_beside(const Upscaler& color, const UpscalerOptions& settings) {
    UpscalerOptions options;
    options.output_size = color.output_size();
    options.dynamic_resolution = settings.dynamic_resolution;
    options.tuning = settings.tuning;
    return options;
}

}  // namespace

AlphaUpscaler::AlphaUpscaler(const Device& device, const Upscaler& color, const Model& model,
                             const UpscalerOptions& settings)
    : upscaler_(device, Model::find("bicubic", model.scale()), color.render_size(), options_beside(color, settings)),
      takes_jitter_out_(takes_jitter_out(model)) {}

void AlphaUpscaler::prepare(const std::function<void(double)>& progress) { upscaler_.prepare(progress); }

io::Pixels AlphaUpscaler::upscale(const io::Pixels& alpha, const FrameDescription& frame) {
    const Size size = upscaler_.output_size();
    io::Pixels result{size, 1, std::vector<float>(static_cast<size_t>(size.width) * size.height, 1.0f)};
    if (std::ranges::all_of(alpha.values, [](float value) { return value == 1; })) return result;

    io::Pixels grey{alpha.size, 3, {}};
    grey.values.reserve(3 * alpha.values.size());
    for (const float value : alpha.values) grey.values.insert(grey.values.end(), 3, value);
    io::Pixels upscaled{size, 3, std::vector<float>(3 * result.values.size())};
    FrameDescription description;
    description.render_size = frame.render_size;
    if (takes_jitter_out_) description.jitter = frame.jitter;
    description.color = image_of(grey);
    description.output = image_of(upscaled);
    upscaler_.submit(description).wait();
    for (size_t i = 0; i < result.values.size(); ++i) result.values[i] = std::clamp(upscaled.values[3 * i], 0.0f, 1.0f);
    return result;
}

io::Pixels with_alpha(const io::Pixels& color, const io::Pixels& alpha) {
    io::Pixels result{color.size, 4, {}};
    result.values.reserve(4 * alpha.values.size());
    for (size_t i = 0; i < alpha.values.size(); ++i) {
        result.values.insert(result.values.end(), &color.values[3 * i], &color.values[3 * i] + 3);
        result.values.push_back(alpha.values[i]);
    }
    return result;
}

}  // namespace clarus::cli
