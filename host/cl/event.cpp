#include "cl/event.h"

#include <algorithm>
#include <thread>

namespace clarus::ocl {
namespace {

bool has_ended(cl_event event) {
    cl_int status = CL_COMPLETE;
    const cl_int answer = clGetEventInfo(event, CL_EVENT_COMMAND_EXECUTION_STATUS, sizeof status, &status, nullptr);
    return answer != CL_SUCCESS || status <= CL_COMPLETE;
}

}  // namespace

// OpenCL has no wait that ends.
bool wait_at_most(std::span<const cl_event> events, std::chrono::duration<double> longest) {
    using Clock = std::chrono::steady_clock;
    const auto begin = Clock::now();
    const std::chrono::duration<double> most(2e-3);
    for (std::chrono::duration<double> pause(5e-5);; pause = std::min(2 * pause, most)) {
        if (std::ranges::all_of(events, has_ended)) return true;
        const std::chrono::duration<double> left = longest - (Clock::now() - begin);
        if (!(left.count() > 0)) return false;
        std::this_thread::sleep_for(std::min(pause, left));
    }
}

}  // namespace clarus::ocl
