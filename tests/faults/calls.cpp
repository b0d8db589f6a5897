// OpenCL calls by name and number: which of them fail, and what is not released of what they made.

#include "calls.h"

#include <array>
#include <atomic>
#include <map>
#include <mutex>
#include <string>
#include <tuple>
#include <type_traits>

#include "fault.h"
#include "layer.h"

namespace clarus::faults {
namespace {

const cl_icd_dispatch* target;
cl_icd_dispatch counted;
const Fault fault = asked_fault();

/// A context whose device goes.
std::atomic<cl_context> losing;
std::atomic<int> calls_until_lost;
std::atomic<bool> is_lost;
cl_int lost_status;

template <typename T>
constexpr const char* kind_of = nullptr;
template <>
constexpr const char* kind_of<cl_context> = "context";
template <>
constexpr const char* kind_of<cl_command_queue> = "queue";
template <>
constexpr const char* kind_of<cl_mem> = "memory";
template <>
constexpr const char* kind_of<cl_program> = "program";
template <>
constexpr const char* kind_of<cl_kernel> = "kernel";
template <>
constexpr const char* kind_of<cl_event> = "event";

/// What calls made, until it is released as often as it was made and retained.
class Objects {
  public:
    void add(void* object, const char* kind) {
        if (!object) return;
        const std::lock_guard lock(mutex_);
        Object& known = objects_[object];
        known.kind = kind;
        ++known.references;
    }
    void remove(void* object) {
        const std::lock_guard lock(mutex_);
        const auto known = objects_.find(object);
        if (known != objects_.end() && --known->second.references == 0) objects_.erase(known);
    }
    void tell() const {
        std::map<std::string, int> left;
        for (const auto& [object, known] : objects_) ++left[known.kind];
        for (const auto& [kind, count] : left) tell_count(("left:" + kind).c_str(), count);
    }

  private:
    struct Object {
        const char* kind = nullptr;
        int references = 0;
    };
    std::mutex mutex_;
    std::map<void*, Object> objects_;
};
Objects objects;

cl_context context_of(cl_command_queue queue) {
    cl_context context = nullptr;
    target->clGetCommandQueueInfo(queue, CL_QUEUE_CONTEXT, sizeof context, &context, nullptr);
    return context;
}

cl_context context_of(cl_event event) {
    cl_context context = nullptr;
    target->clGetEventInfo(event, CL_EVENT_CONTEXT, sizeof context, &context, nullptr);
    return context;
}

/// Whether the device of a context is lost; a call may be that with which it goes.
bool is_lost_in(cl_context context) {
    if (!context || context != losing) return false;
    if (calls_until_lost.fetch_sub(1) <= 0) is_lost = true;
    return is_lost;
}

template <typename First, typename... Others>
bool lost_with(First first, Others...) {
    if constexpr (std::is_same_v<First, cl_command_queue>) return losing && is_lost_in(context_of(first));
    return false;
}

bool lost_with(cl_uint count, const cl_event* events) {  // clWaitForEvents
    return losing && count > 0 && is_lost_in(context_of(events[0]));
}

struct Call {
    const char* name;
    bool waits;  // and does so before it fails
    bool retains, releases;
    std::atomic<unsigned long long> count = 0;

    explicit Call(const char* called)
        : name(called),
          waits(is("clFinish") || is("clWaitForEvents")),
          retains(std::strncmp(name, "clRetain", 8) == 0),
          releases(std::strncmp(name, "clRelease", 9) == 0) {}
    bool is(const char* other) const { return std::strcmp(name, other) == 0; }
};

template <auto Member>
struct Counted;

template <typename Result, typename... Arguments, Result (*cl_icd_dispatch::*Member)(Arguments...)>
struct Counted<Member> {
    static inline Call* call = nullptr;

    /// As the standard has it: the status is what a call returns, or its last argument points to it.
    static Result failed(cl_int status, Arguments... arguments) {
        if constexpr (std::is_same_v<Result, cl_int>) {
            return status;
        } else {
            if (cl_int* const told = std::get<sizeof...(Arguments) - 1>(std::tuple(arguments...))) *told = status;
            return nullptr;
        }
    }

    static void note(Result result, Arguments... arguments) {
        const auto all = std::tuple(arguments...);
        using First = std::tuple_element_t<0, std::tuple<Arguments...>>;
        using Last = std::tuple_element_t<sizeof...(Arguments) - 1, std::tuple<Arguments...>>;
        if constexpr (kind_of<Result> != nullptr) objects.add(result, kind_of<Result>);
        if constexpr (std::is_same_v<Result, cl_int> && kind_of<First> != nullptr)
            if (call->retains && result == CL_SUCCESS) objects.add(std::get<0>(all), kind_of<First>);
        if constexpr (std::is_same_v<Last, cl_event*>)
            if (cl_event* const event = std::get<sizeof...(Arguments) - 1>(all); event && result == CL_SUCCESS)
                objects.add(*event, kind_of<cl_event>);
        if constexpr (std::is_same_v<Result, void*> && sizeof...(Arguments) > 2)  // clEnqueueMapBuffer
            if (cl_event* const event = std::get<sizeof...(Arguments) - 2>(all); event && result)
                objects.add(*event, kind_of<cl_event>);
    }

    static Result CL_API_CALL function(Arguments... arguments) {
        if (call->releases) {
            if constexpr (sizeof...(Arguments) == 1)
                if constexpr (std::is_pointer_v<std::tuple_element_t<0, std::tuple<Arguments...>>>)
                    objects.remove(std::get<0>(std::tuple(arguments...)));
            return (target->*Member)(arguments...);
        }
        const unsigned long long number = ++call->count;
        const bool is_asked = fault.is_of(call->name) && fault.hits(number);
        const bool fails = !call->retains && (is_asked || lost_with(arguments...));
        if (fails && call->waits) (target->*Member)(arguments...);
        if (fails) return failed(is_asked ? fault.code : lost_status, arguments...);
        const Result result = (target->*Member)(arguments...);
        note(result, arguments...);
        return result;
    }
};

#define CLARUS_CALLS(X)                   \
    X(clGetPlatformIDs)                   \
    X(clGetPlatformInfo)                  \
    X(clGetDeviceIDs)                     \
    X(clGetDeviceInfo)                    \
    X(clCreateSubDevices)                 \
    X(clCreateContext)                    \
    X(clGetContextInfo)                   \
    X(clCreateCommandQueue)               \
    X(clCreateCommandQueueWithProperties) \
    X(clGetCommandQueueInfo)              \
    X(clCreateBuffer)                     \
    X(clCreateSubBuffer)                  \
    X(clGetMemObjectInfo)                 \
    X(clCreateProgramWithSource)          \
    X(clCreateProgramWithBinary)          \
    X(clBuildProgram)                     \
    X(clGetProgramInfo)                   \
    X(clGetProgramBuildInfo)              \
    X(clCreateKernel)                     \
    X(clGetKernelWorkGroupInfo)           \
    X(clSetKernelArg)                     \
    X(clWaitForEvents)                    \
    X(clGetEventInfo)                     \
    X(clGetEventProfilingInfo)            \
    X(clCreateUserEvent)                  \
    X(clSetUserEventStatus)               \
    X(clSetEventCallback)                 \
    X(clFlush)                            \
    X(clFinish)                           \
    X(clEnqueueReadBuffer)                \
    X(clEnqueueReadBufferRect)            \
    X(clEnqueueWriteBuffer)               \
    X(clEnqueueWriteBufferRect)           \
    X(clEnqueueFillBuffer)                \
    X(clEnqueueCopyBuffer)                \
    X(clEnqueueMapBuffer)                 \
    X(clEnqueueUnmapMemObject)            \
    X(clEnqueueNDRangeKernel)             \
    X(clEnqueueMarkerWithWaitList)        \
    X(clEnqueueBarrierWithWaitList)       \
    X(clRetainContext)                    \
    X(clRetainCommandQueue)               \
    X(clRetainMemObject)                  \
    X(clRetainProgram)                    \
    X(clRetainKernel)                     \
    X(clRetainEvent)                      \
    X(clReleaseContext)                   \
    X(clReleaseCommandQueue)              \
    X(clReleaseMemObject)                 \
    X(clReleaseProgram)                   \
    X(clReleaseKernel)                    \
    X(clReleaseEvent)

#define CLARUS_CALL(name) Call(#name),
std::array calls{CLARUS_CALLS(CLARUS_CALL)};
#undef CLARUS_CALL

/// The status of a lost device's commands is that of the loss.
cl_int CL_API_CALL get_event_info(cl_event event, cl_event_info name, size_t size, void* value, size_t* needed) {
    const cl_int status = Counted<&cl_icd_dispatch::clGetEventInfo>::function(event, name, size, value, needed);
    if (status == CL_SUCCESS && name == CL_EVENT_COMMAND_EXECUTION_STATUS && value && is_lost &&
        context_of(event) == losing)
        *static_cast<cl_int*>(value) = lost_status;
    return status;
}

struct AtEnd {
    ~AtEnd() {
        for (const Call& call : calls)
            if (call.count != 0 && !call.retains) tell_count(call.name, call.count);
        objects.tell();
    }
} at_end;

}  // namespace
}  // namespace clarus::faults

using namespace clarus::faults;

extern "C" const cl_icd_dispatch* clarus_faults_count(const cl_icd_dispatch* below) {
    target = below;
    counted = *below;
    size_t index = 0;
#define CLARUS_CALL(name)                                     \
    Counted<& cl_icd_dispatch::name>::call = &calls[index++]; \
    counted.name = Counted<&cl_icd_dispatch::name>::function;
    CLARUS_CALLS(CLARUS_CALL)
#undef CLARUS_CALL
    counted.clGetEventInfo = get_event_info;
    return &counted;
}

extern "C" void clarus_faults_lose(cl_context context, int after, cl_int status) {
    is_lost = false;
    calls_until_lost = after;
    lost_status = status;
    losing = context;
}
