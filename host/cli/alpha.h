#pragma once

#include <functional>

#include "clarus/upscaler.h"
#include "io/image.h"

namespace clarus::cli {

/// Upscales colours' alpha beside a model, by the filter `bicubic`, to the same output size.
class AlphaUpscaler {
  public:
    /// `color` upscales the colours, by `model` and `settings`. Plans alone. Errors: those of Upscaler.
    AlphaUpscaler(const Device& device, const Upscaler& color, const Model& model, const UpscalerOptions& settings);

    /// Upscaler::prepare.
    void prepare(const std::function<void(double)>& progress);

    /// Of one channel, of the frame's render size; the result in [0, 1], of its output size. Waits. Where alpha is 1
    /// everywhere, so is the result, exactly. Errors: those of Upscaler::submit and FrameEvent::wait.
    io::Pixels upscale(const io::Pixels& alpha, const FrameDescription& frame);

  private:
    Upscaler upscaler_;
    const bool takes_jitter_out_;
};

/// Colour of 3 channels with alpha as a fourth.
io::Pixels with_alpha(const io::Pixels& color, const io::Pixels& alpha);

}  // namespace clarus::cli
