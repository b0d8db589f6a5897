#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <memory>
#include <regex>

#include "bench/suite.h"
#include "cl/context.h"
#include "cl/event.h"

namespace clarus::bench {
namespace {

constexpr cl_uint kRounds = 20000;
constexpr size_t kCopyBytes = size_t(256) << 20;  // more than any cache

}  // namespace

std::vector<Item> peak_items(const Device& device) {
    ocl::Context& context = device.context();
    const bool gpu = device.profile().device_class == DeviceClass::gpu;
    const size_t group = gpu ? 256 : 1;
    const size_t items = static_cast<size_t>(device.profile().compute_units) * (gpu ? 16 * group : 8);
    std::vector<Item> result;
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

Item copy_item(const Device& device) {
    ocl::Context& context = device.context();
    const cl::Buffer from(context.context(), CL_MEM_READ_WRITE, kCopyBytes);
    const cl::Buffer to(context.context(), CL_MEM_READ_WRITE, kCopyBytes);
    context.queue().enqueueFillBuffer(from, cl_uint(0), 0, kCopyBytes);
    const cl::Program program = context.program("copy", "-DWG_X=1");
    cl::Kernel kernel(program, "copy");
    const size_t items = static_cast<size_t>(device.profile().compute_units) * 64;
    const cl_uint vectors = static_cast<cl_uint>(kCopyBytes / (16 * sizeof(float)) / items);
    kernel.setArg(0, from);
    kernel.setArg(1, to);
    kernel.setArg(2, vectors);
    return {"copy", 0, 2.0 * kCopyBytes, [&context, kernel, from, to, items] {
                cl::Event event;
                context.queue().enqueueNDRangeKernel(kernel, cl::NullRange, cl::NDRange(items), cl::NDRange(1), nullptr,
                                                     &event);
                return ocl::seconds_of(event);
            }};
}

double quick_peak(const std::vector<Item>& items) {
    constexpr int kRuns = 5;
    double most = 0;
    for (int run = 0; run < kRuns; ++run)
        for (const Item& item : items) most = std::max(most, item.operations / item.run());
    return most;
}

double clpeak_peak(const Device& device) {
    // clpeak numbers platforms that have devices; the platform is asked for by its name instead.
    const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen("clpeak --compute-sp 2>/dev/null", "r"), pclose);
    if (!pipe) return 0;
    std::array<char, 256> line{};
    bool on_device = false;
    double most = 0;
    const std::regex figure(R"(^\s*float\d*\s*:\s*([0-9.]+))");
    while (std::fgets(line.data(), line.size(), pipe.get())) {
        const std::string text = line.data();
        if (text.find("Device: ") != std::string::npos)
            on_device = text.find(device.profile().name) != std::string::npos;
        std::smatch match;
        if (on_device && std::regex_search(text, match, figure)) most = std::max(most, 1e9 * std::stod(match[1]));
    }
    return most;
}

}  // namespace clarus::bench
