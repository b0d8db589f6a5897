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

/// Work-items that keep the device busy, and of how many its groups are.
struct Items {
    explicit Items(const DeviceProfile& profile)
        : group(profile.device_class == DeviceClass::gpu ? 256 : 1),
          count(static_cast<size_t>(profile.compute_units) * (group > 1 ? 16 * group : 8)) {}
    size_t group, count;
};

/// `buffers`: the kernel's first arguments, which it does not keep itself.
std::function<double()> timed(ocl::Context& context, cl::Kernel kernel, const Items& items,
                              const std::vector<cl::Buffer>& buffers) {
    for (size_t i = 0; i < buffers.size(); ++i) kernel.setArg(static_cast<cl_uint>(i), buffers[i]);
    return [&context, kernel, items, buffers] {
        cl::Event event;
        context.queue().enqueueNDRangeKernel(kernel, cl::NullRange, cl::NDRange(items.count), cl::NDRange(items.group),
                                             nullptr, &event);
        return ocl::seconds_of(event);
    };
}

}  // namespace

std::vector<Work> int8_peak_sweep(const Device& device) {
    ocl::Context& context = device.context();
    const Items items(device.profile());
    std::vector<Work> result;
    if (!device.profile().vnni) return result;
    for (const int chains : {4, 8, 12, 16, 24}) {
        const cl::Program program =
            context.program("peak_int8", fmt::format("-DCHAINS={} -DWG_X={}", chains, items.group));
        cl::Kernel kernel(program, "peak_int8");
        const cl::Buffer out(context.context(), CL_MEM_WRITE_ONLY, items.count * sizeof(cl_int16));
        kernel.setArg(1, 0x01020304);
        kernel.setArg(2, 0x05f607f8);
        kernel.setArg(3, kRounds);
        result.push_back({fmt::format("int8 × {}", chains), 128.0 * chains * kRounds * static_cast<double>(items.count),
                          0, timed(context, kernel, items, {out})});
    }
    return result;
}

std::vector<Work> peak_sweep(const Device& device) {
    ocl::Context& context = device.context();
    const Items items(device.profile());
    std::vector<Work> result;
    for (const int lanes : {1, 4, 8, 16}) {
        for (const int chains : {4, 8, 12, 16, 24}) {
            const cl::Program program =
                context.program("peak", fmt::format("-DLANES={} -DCHAINS={} -DWG_X={}", lanes, chains, items.group));
            cl::Kernel kernel(program, "peak");
            const cl::Buffer out(context.context(), CL_MEM_WRITE_ONLY, items.count * lanes * sizeof(float));
            kernel.setArg(1, 0.999f);
            kernel.setArg(2, 0.001f);
            kernel.setArg(3, kRounds);
            result.push_back({fmt::format("float{} × {}", lanes, chains),
                              2.0 * lanes * chains * kRounds * static_cast<double>(items.count), 0,
                              timed(context, kernel, items, {out})});
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
        Items items(profile);
        if (!gpu) items.count *= 8;
        const size_t vectors = std::max<size_t>(1, bytes / sizeof(cl_float16) / items.count);
        const size_t moved = vectors * items.count * sizeof(cl_float16);
        const cl::Buffer from(context.context(), CL_MEM_READ_WRITE, moved);
        const cl::Buffer to(context.context(), CL_MEM_READ_WRITE, moved);
        context.queue().enqueueFillBuffer(from, cl_uint(0), 0, moved);
        const cl::Program program =
            context.program("copy", fmt::format("-DWG_X={} -DINTERLEAVED={}", items.group, gpu ? 1 : 0));
        cl::Kernel kernel(program, "copy");
        kernel.setArg(2, static_cast<cl_uint>(vectors));
        return Work{"copy", 0, 2.0 * static_cast<double>(moved), timed(context, kernel, items, {from, to})};
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
