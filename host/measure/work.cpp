#include "measure/work.h"

#include <fmt/format.h>

#include <algorithm>

#include "cl/context.h"
#include "cl/error.h"
#include "cl/event.h"

namespace clarus::measure {
namespace {

constexpr cl_uint kRounds = 20000;
constexpr size_t kCopyBytes = size_t(256) << 20;  // more than any cache

}  // namespace

std::vector<Work> peak_sweep(const Device& device) {
    ocl::Context& context = device.context();
    const bool gpu = device.profile().device_class == DeviceClass::gpu;
    const size_t group = gpu ? 256 : 1;
    const size_t items = static_cast<size_t>(device.profile().compute_units) * (gpu ? 16 * group : 8);
    std::vector<Work> result;
    for (const int lanes : {1, 4, 8, 16}) {
        for (const int chains : {4, 8, 12, 16, 24}) {
            const cl::Program program =
                context.program("peak", fmt::format("-DLANES={} -DCHAINS={} -DWG_X={}", lanes, chains, group));
            cl::Kernel kernel(program, "peak");
            const cl::Buffer out(context.context(), CL_MEM_WRITE_ONLY, items * lanes * sizeof(float));
            kernel.setArg(0, out);
            kernel.setArg(1, 0.999f);
            kernel.setArg(2, 0.001f);
            kernel.setArg(3, kRounds);
            result.push_back({fmt::format("float{} × {}", lanes, chains),
                              2.0 * lanes * chains * kRounds * static_cast<double>(items), 0,
                              [&context, kernel, out, items, group] {
                                  cl::Event event;
                                  context.queue().enqueueNDRangeKernel(kernel, cl::NullRange, cl::NDRange(items),
                                                                       cl::NDRange(group), nullptr, &event);
                                  return ocl::seconds_of(event);
                              }});
        }
    }
    return result;
}

Work copy_work(const Device& device) {
    ocl::Context& context = device.context();
    const DeviceProfile& profile = device.profile();
    const size_t bytes = std::min({kCopyBytes, profile.max_allocation, profile.global_memory / 8});
    return ocl::checked("allocate what is to be copied", [&] {
        const bool gpu = profile.device_class == DeviceClass::gpu;
        const size_t group = gpu ? 256 : 1;
        const size_t items = static_cast<size_t>(profile.compute_units) * (gpu ? 16 * group : 64);
        const size_t vectors = std::max<size_t>(1, bytes / sizeof(cl_float16) / items);
        const size_t moved = vectors * items * sizeof(cl_float16);
        const cl::Buffer from(context.context(), CL_MEM_READ_WRITE, moved);
        const cl::Buffer to(context.context(), CL_MEM_READ_WRITE, moved);
        context.queue().enqueueFillBuffer(from, cl_uint(0), 0, moved);
        const cl::Program program =
            context.program("copy", fmt::format("-DWG_X={} -DINTERLEAVED={}", group, gpu ? 1 : 0));
        cl::Kernel kernel(program, "copy");
        kernel.setArg(0, from);
        kernel.setArg(1, to);
        kernel.setArg(2, static_cast<cl_uint>(vectors));
        return Work{"copy", 0, 2.0 * static_cast<double>(moved), [&context, kernel, from, to, items, group] {
                        cl::Event event;
                        context.queue().enqueueNDRangeKernel(kernel, cl::NullRange, cl::NDRange(items),
                                                             cl::NDRange(group), nullptr, &event);
                        return ocl::seconds_of(event);
                    }};
    });
}

Most most_operations(const std::vector<Work>& works) {
    constexpr int kRuns = 5;
    Most most;
    for (int run = 0; run < kRuns; ++run)
        for (const Work& work : works)
            if (const double rate = work.operations / work.run(); rate > most.operations_a_second) most = {work, rate};
    return most;
}

}  // namespace clarus::measure
