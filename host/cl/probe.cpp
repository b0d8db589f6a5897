#include "cl/probe.h"

#include <array>

#include "base/log.h"
#include "cl/disk_cache.h"
#include "cl/error.h"
#include "cl/profile.h"

namespace clarus::ocl {
namespace {

// 1/3 is read as a half, doubled and written as one. 0x3555 is the half nearest to 1/3; 0x3955 is twice that.
constexpr const char* half_storage_source = R"(
kernel void probe(global half* values) { vstore_half(2.0f * vload_half(0, values), 2, values); }
)";
constexpr std::array<cl_ushort, 3> half_storage_values = {0x3555, 0, 0x3955};

// 2048 + 1 is 2048 in half and 2049 in float, so that a device that computes in float gives itself away: it makes 2 of
// what is 1 in half. Clang defines cl_khr_fp16 exactly where it accepts half; asking it first spares its complaints.
constexpr const char* half_arithmetic_source = R"(
#if defined(cl_khr_fp16) || !defined(__clang__)
#pragma OPENCL EXTENSION cl_khr_fp16 : enable
kernel void probe(global half* values) {
    const half large = values[0], one = values[1];
    values[2] = (large + one) - large + one;
}
#else
kernel void probe(global ushort* values) {}
#endif
)";
constexpr std::array<cl_ushort, 3> half_arithmetic_values = {0x6800, 0x3c00, 0x3c00};

constexpr const char* fast_fma_source = R"(
kernel void probe(global ushort* values) {
#ifdef FP_FAST_FMAF
    values[2] = 1;
#endif
}
)";
constexpr std::array<cl_ushort, 3> fast_fma_values = {0, 0, 1};

class Prober {
  public:
    explicit Prober(const cl::Device& device) : device_(device), context_(device), queue_(context_, device) {}

    // Whether the kernel compiles and, given the first two values and 0, makes the third.
    bool computes(const char* source, const std::array<cl_ushort, 3>& values) const {
        try {
            const cl::Program program(context_, source);
            program.build(device_);
            std::array<cl_ushort, 4> found = {values[0], values[1], 0, 0};
            const cl::Buffer buffer(context_, CL_MEM_READ_WRITE | CL_MEM_COPY_HOST_PTR, sizeof found, found.data());
            cl::Kernel kernel(program, "probe");
            kernel.setArg(0, buffer);
            queue_.enqueueNDRangeKernel(kernel, cl::NullRange, cl::NDRange(1), cl::NDRange(1));
            queue_.enqueueReadBuffer(buffer, CL_TRUE, 0, sizeof found, found.data());
            return found[2] == values[2];
        } catch (const cl::Error&) {
            return false;
        }
    }

  private:
    cl::Device device_;
    cl::Context context_;
    cl::CommandQueue queue_;
};

// A device that claims to be of every type is a simulator, whose compiler takes more than it can run.
bool is_simulator(const cl::Device& device) {
    constexpr cl_device_type every = CL_DEVICE_TYPE_CPU | CL_DEVICE_TYPE_GPU | CL_DEVICE_TYPE_ACCELERATOR;
    return (device.getInfo<CL_DEVICE_TYPE>() & every) == every;
}

Abilities probe_now(const cl::Device& device) {
    const Prober prober(device);
    return {.half_storage = prober.computes(half_storage_source, half_storage_values),
            .half_arithmetic = !is_simulator(device) && prober.computes(half_arithmetic_source, half_arithmetic_values),
            .fast_fma = prober.computes(fast_fma_source, fast_fma_values)};
}

}  // namespace

Abilities probe(const cl::Device& device) {
    try {
        const DiskCache cache(programs_directory());
        const CacheKey key = cache_key(
            {"abilities", half_storage_source, half_arithmetic_source, fast_fma_source, device_identity(device)});
        if (const auto kept = cache.load(key); kept && kept->size() == 3)
            return {(*kept)[0] != 0, (*kept)[1] != 0, (*kept)[2] != 0};
        const Abilities abilities = probe_now(device);
        cache.store(key, {abilities.half_storage, abilities.half_arithmetic, abilities.fast_fma});
        return abilities;
    } catch (const cl::Error& error) {
        log(LogLevel::debug, "a device cannot be probed: {} says {}", error.what(), status_name(error.err()));
        return {};
    }
}

}  // namespace clarus::ocl
