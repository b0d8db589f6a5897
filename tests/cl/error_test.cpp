#include "cl/error.h"

#include <doctest/doctest.h>

#include "test_device.h"

using namespace clarus;

namespace {

Error error_of(cl_int status) {
    try {
        ocl::checked("do a thing", [&] { throw cl::Error(status, "clSomething"); });
    } catch (const Error& error) {
        return error;
    }
    return Error(ErrorKind::invalid_argument, "nothing was thrown");
}

}  // namespace

TEST_SUITE("small") {
    TEST_CASE("an OpenCL status has its name") {
        CHECK(ocl::status_name(CL_OUT_OF_RESOURCES) == "CL_OUT_OF_RESOURCES");
        CHECK(ocl::status_name(CL_INVALID_KERNEL_ARGS) == "CL_INVALID_KERNEL_ARGS");
        CHECK(ocl::status_name(-1001) == "CL_PLATFORM_NOT_FOUND_KHR");
        CHECK(ocl::status_name(-12345) == "OpenCL status -12345");
    }

    TEST_CASE("a failed OpenCL call becomes an error that says which, and what to do") {
        for (const cl_int status : {CL_OUT_OF_RESOURCES, CL_OUT_OF_HOST_MEMORY, CL_MEM_OBJECT_ALLOCATION_FAILURE})
            CHECK(error_of(status).kind() == ErrorKind::out_of_memory);
        CHECK(error_of(CL_INVALID_VALUE).kind() == ErrorKind::device);
        const std::string message = error_of(CL_OUT_OF_RESOURCES).what();
        CHECK(message.find("do a thing") != message.npos);
        CHECK(message.find("CL_OUT_OF_RESOURCES") != message.npos);
        CHECK(message.find("another device") != message.npos);
    }

    TEST_CASE("what OpenCL returns passes through") {
        CHECK(ocl::checked("count", [] { return 7; }) == 7);
    }
}
