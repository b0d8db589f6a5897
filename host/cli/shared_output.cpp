#include "cli/shared_output.h"

#include <algorithm>
#include <utility>

namespace clarus::cli {
namespace {

clarus_share_description describe(const io::Pixels& pixels, ColorSpace color_space) {
    clarus_share_description description = clarus_share_default_description();
    description.resources[CLARUS_SHARE_COLOR] = {
        {CLARUS_F32, pixels.channels}, pixels.size.width, pixels.size.height, 0};
    description.linear_color = color_space == ColorSpace::linear;
    return description;
}

}  // namespace

// Of what size the frames are is known only once one is there.
SharedOutput::SharedOutput(std::string name) : name_(std::move(name)) {
    SharePublisher(name_, describe({.size = {1, 1}, .channels = 3, .values = {}}, ColorSpace::srgb));
}

void SharedOutput::write(const SourceFrame& frame, const io::Pixels& pixels, ColorSpace color_space) {
    if (!publisher_) publisher_.emplace(name_, describe(pixels, color_space));
    clarus_share_frame shared;
    if (!publisher_->begin(shared)) return;
    shared.number = frame.number;
    shared.exposure = frame.inputs.exposure;
    shared.near_plane = frame.inputs.near_plane;
    shared.far_plane = frame.inputs.far_plane;
    shared.frame_seconds = static_cast<float>(frame.seconds);
    shared.reset = frame.inputs.reset;
    if (const auto& camera = frame.inputs.camera) {
        shared.has_matrices = 1;
        shared.fov_y = camera->fov_y;
        std::ranges::copy(camera->view, shared.view);
        std::ranges::copy(camera->projection, shared.projection);
    }
    SharePublisher::copy(shared, CLARUS_SHARE_COLOR, pixels.values.data());
    publisher_->end(shared);
}

void SharedOutput::finish() {
    if (publisher_) publisher_->drain();
}

}  // namespace clarus::cli
