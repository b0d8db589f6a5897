#pragma once

#include <array>
#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "cl/context.h"
#include "runtime/frame_constants.h"
#include "runtime/implementation.h"

namespace clarus::runtime {

/// What the arguments of a kernel call stand for. Only those that the call names need be set.
struct Bindings {
    std::vector<cl::Buffer> inputs;
    cl::Buffer output;
    cl::Buffer packed_weights;
    cl_uint packed_offset = 0;
    FrameConstants frame;
    std::array<cl::Buffer, graph::kResources.size()> resources;  // by graph::Resource
    std::array<cl_uint2, graph::kResources.size()> resource_offsets{};
    cl::Buffer target;
    cl_uint2 target_offset{};
    cl::Buffer counter;
    cl::Buffer exposure_image;
    cl_uint2 exposure_offset{};
    cl::Buffer exposure;
};

/// All that a call's program depends on: calls of the same key have the same.
std::string program_key(const KernelCall& call);

/// The kernels of several calls, compiled as one program: to begin takes a compiler longer than most of them. Those
/// that the context has from other calls are taken from there, so that a network of other views or storage costs what
/// is new in it. The first network of a process, whose start counts, is one program, on disk too; what is new in a
/// later one depends on those before it, and is found on disk where they are the same.
class Kernels {
  public:
    /// Errors: build, of the first call alone that does not compile.
    Kernels(ocl::Context& context, const std::vector<const KernelCall*>& calls);

    /// Compiles those of the calls that are not among them yet, as one program. Errors as above.
    void add(ocl::Context& context, const std::vector<const KernelCall*>& calls);

    /// A new kernel `entry` of the file of one of the calls.
    cl::Kernel create(const KernelCall& call, const std::string& entry) const;

  private:
    std::map<std::string, ocl::UnitPlace> places_;  // by file, options and source
};

/// A kernel call made ready.
class Launch {
  public:
    /// `call` is one of `kernels`.
    Launch(const Kernels& kernels, KernelCall call);

    /// Sets every argument. Arguments keep their values until set again.
    void bind(const Bindings& bindings);
    /// Enqueues with the arguments as they are. `event` may be null.
    void enqueue(const cl::CommandQueue& queue, cl::Event* event = nullptr) const;
    /// The same for rows [first, end) of the result alone. `first` is a multiple of what a work-group makes.
    void enqueue_rows(const cl::CommandQueue& queue, int first, int end, cl::Event* event = nullptr);

    const KernelCall& call() const { return call_; }

  private:
    void set_first_item(int item);

    KernelCall call_;
    cl::Kernel kernel_;
    std::string doing_;             // for error messages
    std::vector<std::byte> sizes_;  // struct Sizes
    cl_uint first_argument_;        // after the sizes
};

/// The kernel that packs sets of a convolution's parameters.
class PackLaunch {
  public:
    /// `packing.call` is one of `kernels`.
    PackLaunch(const Kernels& kernels, const Packing& packing);

    /// One set of weights (OIHW) and biases within buffers of floats.
    struct Source {
        const cl::Buffer& weights;
        size_t weights_offset;
        const cl::Buffer& biases;
        size_t biases_offset;
    };
    /// Enqueues the packing of `source` as set number `set` of `packed`.
    void enqueue(const cl::CommandQueue& queue, const Source& source, const cl::Buffer& packed, int set);

  private:
    Packing packing_;
    cl::Kernel kernel_;
    std::string doing_;
};

}  // namespace clarus::runtime
