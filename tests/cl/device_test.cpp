#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <thread>

#include "cl/context.h"
#include "cl/error.h"
#include "test_device.h"

using namespace clarus;

namespace {

Error error_of(const std::string& selector) {
    try {
        Device::open(selector);
    } catch (const Error& error) {
        return error;
    }
    return Error(ErrorKind::file, "nothing was thrown");
}

std::string upper_case(std::string text) {
    std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return char(std::toupper(c)); });
    return text;
}

}  // namespace

TEST_SUITE("small") {
    TEST_CASE("the device's profile makes sense") {
        const DeviceProfile& profile = test_device().profile();
        CHECK(!profile.name.empty());
        CHECK(!profile.platform.empty());
        CHECK(!profile.driver_version.empty());
        CHECK(profile.opencl_version.rfind("OpenCL ", 0) == 0);
        CHECK(profile.compute_units >= 1);
        CHECK(profile.float_vector_width >= 1);
        CHECK(profile.float_vector_width <= 16);
        CHECK(profile.max_work_group_size >= 1);
        CHECK(profile.max_allocation > 0);
        CHECK(profile.max_allocation <= profile.global_memory);
        CHECK(profile.local_memory >= 32 << 10);
        CHECK(profile.memory_alignment >= 16);
        CHECK((profile.memory_alignment & (profile.memory_alignment - 1)) == 0);
        CHECK(profile.half_storage);  // every OpenCL compiler has vload_half
    }

    TEST_CASE("a process whose threads open its first device all at once") {
        std::vector<std::thread> threads;
        std::atomic<int> opened = 0;
        for (int i = 0; i < 8; ++i)
            threads.emplace_back([&] { opened += !Device::open(test_selector()).profile().name.empty(); });
        for (std::thread& thread : threads) thread.join();
        CHECK(opened == 8);
    }

    TEST_CASE("threads may be the first to open a device") {
        const std::string command =
            std::filesystem::read_symlink("/proc/self/exe").string() +
            " --test-case='a process whose threads open its first device all at once' >/dev/null";
        for (int i = 0; i < 15; ++i) CHECK(std::system(command.c_str()) == 0);
    }

    TEST_CASE("the device under test is in the list") {
        const DeviceProfile& profile = test_device().profile();
        const std::vector<DeviceProfile> list = list_devices();
        const auto found = std::find_if(list.begin(), list.end(), [&](const DeviceProfile& other) {
            return profile.selector.rfind(other.selector, 0) == 0 && other.name == profile.name;
        });
        REQUIRE(found != list.end());
        CHECK(found->half_arithmetic == profile.half_arithmetic);
        CHECK(found->vnni == profile.vnni);
        CHECK(found->bf16 == profile.bf16);
        CHECK(found->fast_fma == profile.fast_fma);
        CHECK(std::is_sorted(list.begin(), list.end(), [](const DeviceProfile& a, const DeviceProfile& b) {
            return a.selector < b.selector;  // fewer than ten platforms, and devices of each
        }));
    }

    TEST_CASE("a selector is a place, a class, or a part of a name") {
        const DeviceProfile profile = list_devices().front();
        CHECK(Device::open(profile.selector).profile().name == profile.name);
        CHECK(Device::open(profile.selector).profile().selector == profile.selector);
        CHECK(Device::open(upper_case(profile.name.substr(1))).profile().name == profile.name);
        CHECK(Device::open(upper_case(profile.platform)).profile().platform == profile.platform);
        const char* const names[] = {"gpu", "cpu", "dsp"};
        const char* const name = names[int(profile.device_class)];
        CHECK(Device::open(name).profile().device_class == profile.device_class);
        CHECK(Device::open(upper_case(name)).profile().device_class == profile.device_class);
    }

    TEST_CASE("a selector may say what class a device is treated as") {
        const DeviceProfile profile = list_devices().front();
        for (const char* name : {"gpu", "cpu", "dsp"}) {
            const Device device = Device::open(fmt::format("{} = {}", profile.selector, name));
            CHECK(device.profile().selector == fmt::format("{}={}", profile.selector, name));
            CHECK(Device::open(device.profile().selector).profile().device_class == device.profile().device_class);
        }
        CHECK(Device::open(profile.selector + "=dsp").profile().device_class == DeviceClass::dsp);
        CHECK(std::string(error_of(profile.selector + "=npu").what()).find("npu") != std::string::npos);
    }

    TEST_CASE("several devices between commas are different, and parts of one device are other parts") {
        const DeviceProfile profile = list_devices().front();
        CHECK(error_of(fmt::format("{0},{0}", profile.selector)).kind() == ErrorKind::invalid_argument);
        CHECK(error_of(profile.selector + ",").kind() == ErrorKind::no_device);
        if (!profile.sub_devices) return;
        const std::string part = profile.selector + "/1";
        CHECK(error_of(profile.selector + ", " + part).kind() == ErrorKind::invalid_argument);
        const Device device = Device::open(part + ", " + part + "=dsp");
        REQUIRE(device.profiles().size() == 2);
        CHECK(device.profiles()[0].device_class == profile.device_class);
        CHECK(device.profiles()[1].device_class == DeviceClass::dsp);
        CHECK(device.contexts()[0]->device()() != device.contexts()[1]->device()());
        CHECK(device.contexts()[0]->context()() == device.contexts()[1]->context()());
        const std::string too_many = fmt::format("{}/{}, {}", profile.selector, profile.compute_units, part);
        CHECK(error_of(too_many).kind() == ErrorKind::invalid_argument);
    }

    TEST_CASE("auto takes a GPU before a DSP before a CPU, then the most compute units") {
        const auto rank = [](const DeviceProfile& profile) {
            const int class_rank[] = {0, 2, 1};  // gpu, cpu, dsp
            return std::pair(class_rank[int(profile.device_class)], -profile.compute_units);
        };
        const DeviceProfile best = Device::open("auto").profile();
        for (const DeviceProfile& profile : list_devices()) CHECK(rank(best) <= rank(profile));
    }

    TEST_CASE("a selector that fits nothing is answered with what there is") {
        for (const char* selector : {"no such device", "97:0", "0:97", "no such device/1", "", "/1"}) {
            const Error error = error_of(selector);
            CHECK(error.kind() == ErrorKind::no_device);
            const std::string message = error.what();
            for (const DeviceProfile& profile : list_devices()) {
                CHECK(message.find(profile.selector) != message.npos);
                CHECK(message.find(profile.name) != message.npos);
            }
        }
    }

    TEST_CASE("a sub-device of more compute units than there are, or of none, is refused") {
        CHECK(error_of("auto/100000").kind() == ErrorKind::invalid_argument);
        CHECK(error_of("auto/0").kind() == ErrorKind::invalid_argument);
    }

    TEST_CASE("a sub-device has the compute units asked for, and runs kernels") {
        const DeviceProfile whole = list_devices().front();
        if (!whole.sub_devices) {
            CHECK(error_of(whole.selector + "/1").kind() == ErrorKind::invalid_argument);
            return;
        }
        const Device device = Device::open(whole.selector + "/1");
        CHECK(device.profile().compute_units == 1);
        CHECK(device.profile().selector == whole.selector + "/1");
        CHECK(device.profile().name == whole.name);

        ocl::Context& context = device.context();
        cl::Kernel kernel(context.program_from_source("one.cl", "kernel void one(global int* v) { v[0] = 1; }", ""),
                          "one");
        const cl::Buffer buffer(context.context(), CL_MEM_READ_WRITE, sizeof(int));
        kernel.setArg(0, buffer);
        context.queue().enqueueNDRangeKernel(kernel, cl::NullRange, cl::NDRange(1));
        int found = 0;
        context.queue().enqueueReadBuffer(buffer, CL_TRUE, 0, sizeof found, &found);
        CHECK(found == 1);
    }

    TEST_CASE("a caller's context, device and queue are taken over and kept") {
        const cl::Device device = test_device().context().device();
        const auto adopt = [&](cl_command_queue_properties properties) {
            const cl::Context context(device);
            const cl::CommandQueue queue(context, device, properties);
            return Device::adopt(context(), device(), queue());  // the caller's handles are released here
        };
        const Device plain = adopt(0);
        CHECK(plain.profile().name == test_device().profile().name);
        CHECK(plain.context().queue_is_callers());
        CHECK(!plain.context().queue_has_profiling());
        CHECK(adopt(CL_QUEUE_PROFILING_ENABLE).context().queue_has_profiling());

        const cl::Buffer buffer(plain.context().context(), CL_MEM_READ_WRITE, sizeof(int));
        int value = 5;
        plain.context().queue().enqueueWriteBuffer(buffer, CL_TRUE, 0, sizeof value, &value);
        value = 0;
        plain.context().queue().enqueueReadBuffer(buffer, CL_TRUE, 0, sizeof value, &value);
        CHECK(value == 5);

        if (device.getInfo<CL_DEVICE_QUEUE_PROPERTIES>() & CL_QUEUE_OUT_OF_ORDER_EXEC_MODE_ENABLE) {
            const Device unordered = adopt(CL_QUEUE_OUT_OF_ORDER_EXEC_MODE_ENABLE);
            CHECK(!unordered.context().queue_is_callers());
            CHECK(
                !(unordered.context().queue().getInfo<CL_QUEUE_PROPERTIES>() & CL_QUEUE_OUT_OF_ORDER_EXEC_MODE_ENABLE));
        }
    }

    TEST_CASE("what cannot be taken over is refused") {
        const ocl::Context& context = test_device().context();
        CHECK_THROWS_AS(Device::adopt(nullptr, context.device()(), context.queue()()), Error);
        CHECK_THROWS_AS(Device::adopt(context.context()(), context.device()(), nullptr), Error);
        const cl::Context other(context.device());
        CHECK_THROWS_AS(Device::adopt(other(), context.device()(), context.queue()()), Error);
    }
}

// Not in the small suite: Oclgrind answers with std::bad_alloc.
TEST_CASE("more memory than the device has is an error of that kind") {
    ocl::Context& context = test_device().context();
    try {
        const size_t bytes = size_t(1) << 46;
        ocl::checked("allocate 64 TiB", [&] { return cl::Buffer(context.context(), CL_MEM_READ_WRITE, bytes); });
        FAIL("64 TiB were allocated");
    } catch (const Error& error) {
        CHECK(error.kind() == ErrorKind::out_of_memory);
    }
}
