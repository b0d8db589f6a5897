#include "cl/error.h"

namespace clarus::ocl {
namespace {

struct Meaning {
    ErrorKind kind;
    std::string_view reason, way_out;
};

Meaning meaning(cl_int status) {
    constexpr std::string_view less_memory = "Take a smaller image or model, precision fp16, or another device";
    constexpr std::string_view open_anew = "Open it anew, or take another device (`clarus devices`)";
    switch (status) {
        case CL_OUT_OF_RESOURCES:
        case CL_OUT_OF_HOST_MEMORY:
        case CL_MEM_OBJECT_ALLOCATION_FAILURE:
            return {ErrorKind::out_of_memory, "there is not enough memory", less_memory};
        case CL_INVALID_BUFFER_SIZE:
            return {ErrorKind::out_of_memory, "the device allows no buffer of this size", less_memory};
        case CL_DEVICE_NOT_AVAILABLE:
            return {ErrorKind::device, "the device is not available: it was lost, or another process holds it",
                    open_anew};
        case CL_INVALID_COMMAND_QUEUE:
            return {ErrorKind::device, "the driver gave up the queue, as where the device was lost", open_anew};
        case CL_COMPILER_NOT_AVAILABLE:
            return {ErrorKind::device, "the driver has no compiler", "Take another device or driver"};
        default:
            return {ErrorKind::device, "the driver refuses", "Another device (`clarus devices`) or driver may help"};
    }
}

}  // namespace

std::string status_name(cl_int status) {
    switch (status) {
#define NAME(status) \
    case status:     \
        return #status;
        NAME(CL_DEVICE_NOT_FOUND)
        NAME(CL_DEVICE_NOT_AVAILABLE)
        NAME(CL_COMPILER_NOT_AVAILABLE)
        NAME(CL_MEM_OBJECT_ALLOCATION_FAILURE)
        NAME(CL_OUT_OF_RESOURCES)
        NAME(CL_OUT_OF_HOST_MEMORY)
        NAME(CL_PROFILING_INFO_NOT_AVAILABLE)
        NAME(CL_MEM_COPY_OVERLAP)
        NAME(CL_IMAGE_FORMAT_MISMATCH)
        NAME(CL_IMAGE_FORMAT_NOT_SUPPORTED)
        NAME(CL_BUILD_PROGRAM_FAILURE)
        NAME(CL_MAP_FAILURE)
        NAME(CL_MISALIGNED_SUB_BUFFER_OFFSET)
        NAME(CL_EXEC_STATUS_ERROR_FOR_EVENTS_IN_WAIT_LIST)
        NAME(CL_COMPILE_PROGRAM_FAILURE)
        NAME(CL_LINKER_NOT_AVAILABLE)
        NAME(CL_LINK_PROGRAM_FAILURE)
        NAME(CL_DEVICE_PARTITION_FAILED)
        NAME(CL_KERNEL_ARG_INFO_NOT_AVAILABLE)
        NAME(CL_INVALID_VALUE)
        NAME(CL_INVALID_DEVICE_TYPE)
        NAME(CL_INVALID_PLATFORM)
        NAME(CL_INVALID_DEVICE)
        NAME(CL_INVALID_CONTEXT)
        NAME(CL_INVALID_QUEUE_PROPERTIES)
        NAME(CL_INVALID_COMMAND_QUEUE)
        NAME(CL_INVALID_HOST_PTR)
        NAME(CL_INVALID_MEM_OBJECT)
        NAME(CL_INVALID_IMAGE_FORMAT_DESCRIPTOR)
        NAME(CL_INVALID_IMAGE_SIZE)
        NAME(CL_INVALID_SAMPLER)
        NAME(CL_INVALID_BINARY)
        NAME(CL_INVALID_BUILD_OPTIONS)
        NAME(CL_INVALID_PROGRAM)
        NAME(CL_INVALID_PROGRAM_EXECUTABLE)
        NAME(CL_INVALID_KERNEL_NAME)
        NAME(CL_INVALID_KERNEL_DEFINITION)
        NAME(CL_INVALID_KERNEL)
        NAME(CL_INVALID_ARG_INDEX)
        NAME(CL_INVALID_ARG_VALUE)
        NAME(CL_INVALID_ARG_SIZE)
        NAME(CL_INVALID_KERNEL_ARGS)
        NAME(CL_INVALID_WORK_DIMENSION)
        NAME(CL_INVALID_WORK_GROUP_SIZE)
        NAME(CL_INVALID_WORK_ITEM_SIZE)
        NAME(CL_INVALID_GLOBAL_OFFSET)
        NAME(CL_INVALID_EVENT_WAIT_LIST)
        NAME(CL_INVALID_EVENT)
        NAME(CL_INVALID_OPERATION)
        NAME(CL_INVALID_GL_OBJECT)
        NAME(CL_INVALID_BUFFER_SIZE)
        NAME(CL_INVALID_MIP_LEVEL)
        NAME(CL_INVALID_GLOBAL_WORK_SIZE)
        NAME(CL_INVALID_PROPERTY)
        NAME(CL_INVALID_IMAGE_DESCRIPTOR)
        NAME(CL_INVALID_COMPILER_OPTIONS)
        NAME(CL_INVALID_LINKER_OPTIONS)
        NAME(CL_INVALID_DEVICE_PARTITION_COUNT)
        NAME(CL_INVALID_PIPE_SIZE)
        NAME(CL_INVALID_DEVICE_QUEUE)
        NAME(CL_INVALID_SPEC_ID)
        NAME(CL_MAX_SIZE_RESTRICTION_EXCEEDED)
#undef NAME
        case -1001:
            return "CL_PLATFORM_NOT_FOUND_KHR";
        default:
            return fmt::format("OpenCL status {}", status);
    }
}

void fail_with_status(std::string_view doing, cl_int status) {
    const auto [kind, reason, way_out] = meaning(status);
    fail(kind, "could not {}: {} ({}). {}", doing, reason, status_name(status), way_out);
}

}  // namespace clarus::ocl
