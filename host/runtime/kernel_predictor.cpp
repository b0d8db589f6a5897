#include "runtime/kernel_predictor.h"

#include <clblast.h>
#include <fmt/format.h>

#include "base/error.h"
#include "cl/error.h"

namespace clarus::runtime {
namespace {

constexpr size_t kRectifyGroup = 64;

cl::Buffer upload(ocl::Context& context, const std::vector<float>& values) {
    const size_t bytes = values.size() * sizeof(float);
    cl::Buffer buffer(context.context(), CL_MEM_READ_ONLY, bytes);
    context.queue().enqueueWriteBuffer(buffer, CL_TRUE, 0, bytes, values.data());
    return buffer;
}

}  // namespace

KernelPredictor::KernelPredictor(ocl::Context& context, const std::vector<graph::DenseLayer>& layers)
    : context_(context) {
    ocl::checked("upload the kernel-predicting layers", [&] {
        jitter_ = cl::Buffer(context.context(), CL_MEM_READ_ONLY, sizeof(cl_float2));
        for (const graph::DenseLayer& layer : layers)
            layers_.push_back({static_cast<size_t>(layer.out), static_cast<size_t>(layer.in),
                               upload(context, layer.weights), upload(context, layer.biases),
                               cl::Buffer(context.context(), CL_MEM_READ_WRITE, layer.out * sizeof(float))});
        rectify_ = cl::Kernel(context.program("dense", fmt::format("-DWG_X={}", kRectifyGroup)), "rectify");
    });
    predict({});  // CLBlast compiles its kernels when they are first run
}

const cl::Buffer& KernelPredictor::predict(Vec2 jitter) {
    ocl::checked("predict kernels", [&] {
        cl_command_queue queue = context_.queue()();
        // A fill takes its value along, so that nothing waits for the queue.
        context_.queue().enqueueFillBuffer(jitter_, cl_float2{{jitter.x, jitter.y}}, 0, sizeof(cl_float2));
        const cl::Buffer* input = &jitter_;
        for (Layer& layer : layers_) {
            context_.queue().enqueueCopyBuffer(layer.biases, layer.result, 0, 0, layer.out * sizeof(float));
            const clblast::StatusCode status = clblast::Gemv<float>(
                clblast::Layout::kRowMajor, clblast::Transpose::kNo, layer.out, layer.in, 1.0f, layer.weights(), 0,
                layer.in, (*input)(), 0, 1, 1.0f, layer.result(), 0, 1, &queue);
            if (status != clblast::StatusCode::kSuccess)
                fail(ErrorKind::device, "CLBlast cannot run a dense layer of {} × {}: status {}", layer.out, layer.in,
                     static_cast<int>(status));
            if (&layer != &layers_.back()) {
                rectify_.setArg(0, layer.result);
                rectify_.setArg(1, static_cast<cl_uint>(layer.out));
                const size_t groups = (layer.out + kRectifyGroup - 1) / kRectifyGroup;
                context_.queue().enqueueNDRangeKernel(rectify_, cl::NullRange, cl::NDRange(groups * kRectifyGroup),
                                                      cl::NDRange(kRectifyGroup));
            }
            input = &layer.result;
        }
    });
    return layers_.back().result;
}

size_t KernelPredictor::bytes(const std::vector<graph::DenseLayer>& layers) {
    size_t floats = 2;
    for (const graph::DenseLayer& layer : layers) floats += layer.weights.size() + layer.biases.size() + layer.out;
    return floats * sizeof(float);
}

}  // namespace clarus::runtime
