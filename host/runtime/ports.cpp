#include "runtime/ports.h"

#include <algorithm>
#include <optional>
#include <stdexcept>

#include "base/image_format.h"
#include "cl/image_object.h"
#include "runtime/inputs.h"

namespace clarus::runtime {
namespace {

using graph::Resource;

ImageFormat format_of(Resource resource, const StreamOptions& options) {
    switch (resource) {
        case Resource::color:
            return options.color_format;
        case Resource::depth:
            return options.depth_format;
        case Resource::motion:
            return options.motion_format;
        case Resource::reactive_mask:
            return options.reactive_format.value();
        case Resource::transparency_mask:
            return options.transparency_format.value();
        case Resource::opaque_color:
            return options.opaque_format.value();
        case Resource::ui:
            return options.ui_format.value();
        case Resource::alpha:
            return options.color_format;
    }
    throw std::logic_error("unknown resource");
}

const Image& image_of(Resource resource, const FrameDescription& frame) {
    switch (resource) {
        case Resource::color:
            return frame.color;
        case Resource::depth:
            return frame.depth;
        case Resource::motion:
            return frame.motion;
        case Resource::reactive_mask:
            return frame.reactive_mask;
        case Resource::transparency_mask:
            return frame.transparency_mask;
        case Resource::opaque_color:
            return frame.opaque_color;
        case Resource::ui:
            return frame.ui;
        case Resource::alpha:
            return frame.color;
    }
    throw std::logic_error("unknown resource");
}

Size size_of(const TensorLayout& layout) { return {layout.width, layout.height}; }

const TensorLayout& output_of(const Plan& plan) { return plan.layout.layouts[plan.layout.graph.output]; }

/// Whether it is read from the image that colour is read from, of which one copy serves both.
bool shares_color(Resource resource, const IngestProblem& problem) {
    return resource == Resource::alpha && problem.color;
}

size_t input_bytes(Resource resource, const Plan& plan, const StreamOptions& options) {
    const std::optional<TensorLayout>& layout = layout_of(resource, plan.ingest);
    if (!layout || shares_color(resource, plan.ingest)) return 0;
    const Size size = resource == Resource::motion ? options.motion_size.value_or(size_of(*layout)) : size_of(*layout);
    return tight_bytes(size, format_of(resource, options));
}

size_t output_bytes(const Plan& plan, const StreamOptions& options) {
    return !plan.presents() ? 0 : tight_bytes(size_of(output_of(plan)), options.output_format);
}

cl_uint2 offset_and_pitch(size_t offset, size_t pitch) {
    return {{static_cast<cl_uint>(offset), static_cast<cl_uint>(pitch)}};
}

}  // namespace

Ports::Ports(ocl::Context& context, const Plan& plan, const StreamOptions& options, Profiler& profiler)
    : context_(context), options_(options), profiler_(profiler), output_bytes_(output_bytes(plan, options)) {
    for (const Resource resource : graph::kResources)
        input_bytes_[static_cast<int>(resource)] = input_bytes(resource, plan, options);
}

void Ports::add_stages() {
    upload_stage_ = profiler_.add_stage("upload", "copy", 0, 0);
    read_back_stage_ = profiler_.add_stage("read back", "copy", 0, 0);
}

void Ports::bind_inputs(const FrameDescription& frame, const IngestProblem& problem, Bindings& ingest) {
    for (const Resource resource : graph::kResources) {
        const std::optional<TensorLayout>& layout = layout_of(resource, problem);
        if (!layout) continue;
        const Image& image = image_of(resource, frame);
        const int index = static_cast<int>(resource), color = static_cast<int>(Resource::color);
        if (image.empty()) {
            bind_nothing(resource, *layout, ingest);
        } else if (shares_color(resource, problem)) {
            ingest.resources[index] = ingest.resources[color];
            ingest.resource_offsets[index] = ingest.resource_offsets[color];
        } else {
            ingest.resources[index] = placed(image, format_of(resource, options_), inputs_[index], input_bytes_[index],
                                             ingest.resource_offsets[index]);
        }
    }
}

void Ports::bind_exposure(const Image& image, Bindings& exposure) {
    const ImageFormat& format = options_.exposure_format.value();
    exposure.exposure_image = placed(image, format, exposure_, pixel_bytes(format), exposure.exposure_offset);
}

// All rows of the image are the one that is there.
void Ports::bind_nothing(Resource resource, const TensorLayout& layout, Bindings& ingest) {
    const int index = static_cast<int>(resource);
    const size_t row = tight_pitch(size_of(layout), format_of(resource, options_));
    if (!nothing_() || nothing_.getInfo<CL_MEM_SIZE>() < row) nothing_ = zeroed(row);
    ingest.resources[index] = nothing_;
    ingest.resource_offsets[index] = offset_and_pitch(0, 0);
}

cl::Buffer Ports::placed(const Image& image, const ImageFormat& format, cl::Buffer& copy, size_t bytes,
                         cl_uint2& place) {
    if (image.buffer) {
        place = offset_and_pitch(first_byte(image, format), row_pitch(image, format));
        return cl::Buffer(image.buffer, true);
    }
    if (!copy()) copy = cl::Buffer(context_.context(), CL_MEM_READ_ONLY, bytes);
    const size_t tight = tight_pitch(image.size, format), rows = image.size.height;
    place = offset_and_pitch(0, tight);
    if (image.image) {
        const ocl::ImageObject from(image);
        context_.queue().enqueueCopyImageToBuffer(from.object, copy, from.origin, from.region, 0, nullptr,
                                                  profiler_.event(upload_stage_));
        return copy;
    }
    const auto* pixels = static_cast<const std::byte*>(image.host) + first_byte(image, format);
    context_.queue().enqueueWriteBufferRect(copy, CL_FALSE, {0, 0, 0}, {0, 0, 0}, {tight, rows, 1}, tight, 0,
                                            row_pitch(image, format), 0, pixels, nullptr,
                                            profiler_.event(upload_stage_));
    return copy;
}

void Ports::bind_output(const Image& image, Bindings& present) {
    const ImageFormat& format = options_.output_format;
    if (image.buffer) {
        present.target = cl::Buffer(image.buffer, true);
        present.target_offset = offset_and_pitch(first_byte(image, format), row_pitch(image, format));
        return;
    }
    if (!output_()) output_ = cl::Buffer(context_.context(), CL_MEM_READ_WRITE, output_bytes_);
    present.target = output_;
    present.target_offset = offset_and_pitch(0, tight_pitch(image.size, format));
}

void Ports::hand_back(const Image& image) {
    if (image.buffer) return;
    if (image.image) {
        const ocl::ImageObject to(image);
        context_.queue().enqueueCopyBufferToImage(output_, to.object, 0, to.origin, to.region, nullptr,
                                                  profiler_.event(read_back_stage_));
        return;
    }
    const ImageFormat& format = options_.output_format;
    const size_t tight = tight_pitch(image.size, format), rows = image.size.height;
    auto* pixels = static_cast<std::byte*>(image.host) + first_byte(image, format);
    context_.queue().enqueueReadBufferRect(output_, CL_FALSE, {0, 0, 0}, {0, 0, 0}, {tight, rows, 1}, tight, 0,
                                           row_pitch(image, format), 0, pixels, nullptr,
                                           profiler_.event(read_back_stage_));
}

cl::Buffer Ports::zeroed(size_t bytes) const {
    const cl::Buffer buffer(context_.context(), CL_MEM_READ_WRITE, bytes);
    context_.queue().enqueueFillBuffer(buffer, cl_uchar(0), 0, bytes);
    return buffer;
}

void Ports::stand_in_inputs(const Plan& plan, Bindings& ingest) const {
    for (const Resource resource : graph::kResources) {
        const int index = static_cast<int>(resource);
        if (const size_t bytes = input_bytes(resource, plan, options_)) ingest.resources[index] = zeroed(bytes);
        if (shares_color(resource, plan.ingest))
            ingest.resources[index] = ingest.resources[static_cast<int>(Resource::color)];
    }
}

void Ports::stand_in_exposure(Bindings& exposure) const {
    if (options_.exposure_format) exposure.exposure_image = zeroed(pixel_bytes(*options_.exposure_format));
}

void Ports::stand_in_output(const Plan& plan, Bindings& present) const {
    present.target = zeroed(output_bytes(plan, options_));
    present.target_offset = offset_and_pitch(0, tight_pitch(size_of(output_of(plan)), options_.output_format));
}

size_t Ports::bytes(const Plan& plan, const StreamOptions& options) {
    size_t bytes = output_bytes(plan, options);
    if (options.exposure_format) bytes += pixel_bytes(*options.exposure_format);
    for (const Resource resource : graph::kResources) bytes += input_bytes(resource, plan, options);
    return bytes;
}

double exposure_bytes(const Plan& plan, const StreamOptions& options) {
    if (options.exposure_format) return static_cast<double>(pixel_bytes(*options.exposure_format));
    const Size color = size_of(plan.ingest.color.value());
    return static_cast<double>(std::min(color.width, kExposureSamples)) * std::min(color.height, kExposureSamples) *
           static_cast<double>(pixel_bytes(options.color_format));
}

double ingest_bytes(const Plan& plan, const StreamOptions& options) {
    double bytes = 0;
    for (const Resource resource : graph::kResources)
        bytes += static_cast<double>(input_bytes(resource, plan, options));
    for (const auto* written : destinations(plan.ingest))
        if (*written) bytes += tensor_bytes(**written);
    return bytes;
}

double present_bytes(const Plan& plan, const StreamOptions& options) {
    return tensor_bytes(output_of(plan)) + static_cast<double>(output_bytes(plan, options));
}

}  // namespace clarus::runtime
