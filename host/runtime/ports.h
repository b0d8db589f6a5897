#pragma once

#include <array>

#include "cl/context.h"
#include "clarus/stream.h"
#include "runtime/launch.h"
#include "runtime/plan.h"
#include "runtime/profiler.h"

namespace clarus::runtime {

/// Where a frame's images come from and go to: the caller's buffers, or copies of host images and of image objects in
/// buffers on the device.
class Ports {
  public:
    /// Copies are made as large as `plan` needs them, when they are first needed. `options` outlives the ports.
    Ports(ocl::Context& context, const Plan& plan, const StreamOptions& options, Profiler& profiler);

    /// Declares the copies to the profiler.
    void add_stages();

    /// Points `ingest` to the frame's images, of the plan's sizes; what is no buffer is on its way to one.
    void bind_inputs(const FrameDescription& frame, const IngestProblem& problem, Bindings& ingest);

    /// Points `exposure` to the frame's exposure image, likewise.
    void bind_exposure(const Image& image, Bindings& exposure);

    /// Points `present` to the frame's output.
    void bind_output(const Image& image, Bindings& present);
    /// Copies what was presented to the output, where that is no buffer.
    void hand_back(const Image& image);

    /// Points them to images of the ports' own, for a frame that nobody sees.
    void stand_in_inputs(const Plan& plan, Bindings& ingest) const;
    void stand_in_exposure(Bindings& exposure) const;
    void stand_in_output(const Plan& plan, Bindings& present) const;

    /// Bytes of the copies, were no image a buffer.
    static size_t bytes(const Plan& plan, const StreamOptions& options);

  private:
    /// Where the image's bytes are on the device, and how (offset, pitch): its own buffer, or `copy`, which is made of
    /// `bytes` bytes where it is not there.
    cl::Buffer placed(const Image& image, const ImageFormat& format, cl::Buffer& copy, size_t bytes, cl_uint2& place);
    void bind_nothing(graph::Resource resource, const TensorLayout& layout, Bindings& ingest);
    cl::Buffer zeroed(size_t bytes) const;

    ocl::Context& context_;
    const StreamOptions& options_;
    Profiler& profiler_;
    int upload_stage_ = -1, read_back_stage_ = -1;
    std::array<size_t, graph::kResources.size()> input_bytes_;  // of copies, by graph::Resource
    size_t output_bytes_;
    std::array<cl::Buffer, graph::kResources.size()> inputs_;
    cl::Buffer exposure_;
    cl::Buffer nothing_;  // a row of zeros
    cl::Buffer output_;
};

/// A frame's bytes that make_exposure reads, that ingest reads and writes, and that present does.
double exposure_bytes(const Plan& plan, const StreamOptions& options);
double ingest_bytes(const Plan& plan, const StreamOptions& options);
double present_bytes(const Plan& plan, const StreamOptions& options);

}  // namespace clarus::runtime
