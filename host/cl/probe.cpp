#include "cl/probe.h"

#include <array>
#include <optional>

#include "base/log.h"
#include "cl/build.h"
#include "cl/disk_cache.h"
#include "cl/error.h"
#include "cl/kernel_source.h"
#include "cl/platforms.h"
#include "cl/profile.h"

namespace clarus::ocl {
namespace {

using Values = std::array<cl_ushort, 4>;

// The first value, the half nearest to 1/3, is read as one, doubled, and written as one: twice that. The others say
// what the compiler claims. Clang defines cl_khr_fp16 exactly where it accepts arithmetic in half; others may take it
// anyway.
constexpr const char* claims_source = R"(
kernel void probe(global ushort* values) {
    vstore_half(2.0f * vload_half(0, (global half*)values), 1, (global half*)values);
#ifdef FAST_FMA  // as common.clh has it
    values[2] = 1;
#endif
#if defined(cl_khr_fp16) || !defined(__clang__)
    values[3] = 1;
#endif
}
)";
constexpr Values claims_given = {0x3555, 0, 0, 0};
constexpr cl_ushort doubled = 0x3955;

// 2048 + 1 is 2048 in half and 2049 in float, so that a device that computes in float gives itself away: it makes 2 of
// what is 1 in half.
constexpr const char* half_arithmetic_source = R"(
#pragma OPENCL EXTENSION cl_khr_fp16 : enable
kernel void probe(global half* values) {
    const half large = values[0], one = values[1];
    values[2] = (large + one) - large + one;
}
)";
constexpr cl_ushort half_one = 0x3c00;
constexpr Values half_arithmetic_given = {0x6800, half_one, 0, 0};

// Asks the processor and the system, not the driver, for instructions on registers of 512 bits. Compilers that do not
// say that they use such registers, and would refuse the assembly, are given none: PoCL's tells standard error of
// errors.
constexpr const char* x86_source = R"(
#if defined(__x86_64__) && defined(__AVX512F__)
#define WIDE_X86
typedef struct { uint a, b, c, d; } Registers;
static inline __attribute__((always_inline)) Registers cpuid(uint leaf, uint part) {
    Registers r = {leaf, 0, part, 0};
    __asm__ volatile("cpuid" : "+a"(r.a), "=b"(r.b), "+c"(r.c), "=d"(r.d));
    return r;
}
static inline __attribute__((always_inline)) int has_wide_registers(void) {
    const uint xgetbv = cpuid(1, 0).c >> 27 & 1, wide = cpuid(7, 0).b >> 16 & 1;
    if (!xgetbv || !wide) return 0;
    uint a = 0, d, c = 0;
    __asm__ volatile("xgetbv" : "+a"(a), "=d"(d) : "c"(c));
    return (a & 0xe6) == 0xe6;  // the system keeps all of them
}
#endif
)";

constexpr const char* vnni_source = R"(
kernel void probe(global ushort* values) {
#ifdef WIDE_X86
    if (!has_wide_registers() || !(cpuid(7, 0).c >> 11 & 1)) return;
    int16 sum = 1;
    const int16 numbers = (int16)(0x01ff0000), weights = (int16)(0x0280ffff);
    __asm__("vpdpbusd %2, %1, %0" : "+v"(sum) : "v"(numbers), "v"(weights));
    values[0] = sum.s0 == 1 + 1 * 2 + 255 * -128 && sum.sf == sum.s0;
#endif
}
)";

// Products of bfloat16, and rounding to it: 1 + 2 * 3 + 4 * 5, and 1 + 1/256, which is half-way to the odd neighbour.
constexpr const char* bf16_source = R"(
kernel void probe(global ushort* values) {
#ifdef WIDE_X86
    const uint on_shorter_registers = cpuid(7, 0).b >> 31;
    if (!has_wide_registers() || !on_shorter_registers || cpuid(7, 0).a == 0 || !(cpuid(7, 1).a >> 5 & 1)) return;
    float16 sum = 1.0f;
    const uint16 numbers = (uint16)(0x40804000), weights = (uint16)(0x40a04040);
    __asm__("vdpbf16ps %2, %1, %0" : "+v"(sum) : "v"(numbers), "v"(weights));
    ushort16 rounded;
    __asm__("vcvtneps2bf16 %1, %0" : "=v"(rounded) : "v"((float16)(1.00390625f)));
    ushort8 four;
    __asm__("vcvtneps2bf16 %1, %0" : "=v"(four) : "v"((float4)(1.00390625f)));
    values[0] = sum.s0 == 27.0f && sum.sf == sum.s0 && rounded.s0 == 0x3f80 && rounded.sf == rounded.s0 &&
                four.s0 == rounded.s0 && four.s3 == rounded.s0;
#endif
}
)";

/// Of a call that may succeed another time: it says nothing of the device's abilities.
bool may_pass(cl_int status) {
    return status == CL_OUT_OF_RESOURCES || status == CL_OUT_OF_HOST_MEMORY ||
           status == CL_MEM_OBJECT_ALLOCATION_FAILURE || status == CL_DEVICE_NOT_AVAILABLE;
}

/// What the kernel makes of the values; they come back as they were where it does not compile or run. `passing`: the
/// status, where may_pass.
Values run(const cl::Device& device, const std::string& source, Values values, std::optional<cl_int>& passing) {
    try {
        const cl::Context context(device);
        const cl::CommandQueue queue(context, device);
        const cl::Program program(context, source);
        build_program(program, device);
        const cl::Buffer buffer(context, CL_MEM_READ_WRITE | CL_MEM_COPY_HOST_PTR, sizeof values, values.data());
        cl::Kernel kernel(program, "probe");
        kernel.setArg(0, buffer);
        queue.enqueueNDRangeKernel(kernel, cl::NullRange, cl::NDRange(1), cl::NDRange(1));
        queue.enqueueReadBuffer(buffer, CL_TRUE, 0, sizeof values, values.data());
    } catch (const cl::Error& error) {
        log(LogLevel::debug, "a probe fails: {} says {}", error.what(), status_name(error.err()));
        if (may_pass(error.err())) passing = error.err();
    }
    return values;
}

Abilities probe_now(const cl::Device& device, const std::string& claims_program, std::optional<cl_int>& passing) {
    const Values claims = run(device, claims_program, claims_given, passing);
    Abilities abilities{.half_storage = claims[1] == doubled, .half_arithmetic = false, .fast_fma = claims[2] == 1};
    // A simulator's compiler takes more than it can run.
    if (is_simulator(device)) return abilities;
    if (claims[3] == 1)
        abilities.half_arithmetic = run(device, half_arithmetic_source, half_arithmetic_given, passing)[2] == half_one;
    abilities.vnni = run(device, std::string(x86_source) + vnni_source, {}, passing)[0] == 1;
    // Processors that have it have VNNI, too; others are spared the compiling.
    abilities.bf16 = abilities.vnni && run(device, std::string(x86_source) + bf16_source, {}, passing)[0] == 1;
    return abilities;
}

}  // namespace

Abilities probe(const cl::Device& device) {
    const DiskCache cache(programs_directory());
    const ProgramUnit claims{"probe.cl", claims_source, ""};
    const std::string claims_program = program_text({&claims, 1});
    const CacheKey key = hash_of_parts({"abilities", claims_program, half_arithmetic_source, x86_source, vnni_source,
                                        bf16_source, device_identity(device)});
    if (const auto kept = cache.load(key); kept && kept->size() == 5)
        return {(*kept)[0] != 0, (*kept)[1] != 0, (*kept)[2] != 0, (*kept)[3] != 0, (*kept)[4] != 0};
    std::optional<cl_int> passing;
    const Abilities abilities = probe_now(device, claims_program, passing);
    if (passing)
        log(LogLevel::warning,
            "could not find out all that {} is able to ({}): what is not known it does without until the next start",
            device.getInfo<CL_DEVICE_NAME>(), status_name(*passing));
    // Every compiler has vload_half: where it fails, something else went wrong, which may pass.
    else if (abilities.half_storage)
        cache.store(key, {abilities.half_storage, abilities.half_arithmetic, abilities.fast_fma, abilities.vnni,
                          abilities.bf16});
    return abilities;
}

}  // namespace clarus::ocl
