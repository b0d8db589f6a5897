/* An OpenCL layer in which calls fail when a test says so: a device that was lost, on any machine. */
#include "layer.h"

#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "calls.h"

enum { kDevices = 8, kEvents = 256 };

/* Which calls fail: those of a context, or of the device of that number. Written while no OpenCL call is on its way. */
struct fault {
    cl_context context;
    int device; /* −1: none */
    atomic_int calls_left;
    cl_int status;
};

static const struct _cl_icd_dispatch* target;
static struct _cl_icd_dispatch dispatch;
static struct fault kernels = {.device = -1}, markers = {.device = -1};
static _Atomic(cl_event) failed[kEvents];
static atomic_int failed_count;
static _Atomic(cl_device_id) devices[kDevices]; /* in the order in which kernels were enqueued on them */

static cl_context context_of(cl_command_queue queue) {
    cl_context context = NULL;
    target->clGetCommandQueueInfo(queue, CL_QUEUE_CONTEXT, sizeof(context), &context, NULL);
    return context;
}

static int number_of(cl_command_queue queue) {
    cl_device_id device = NULL;
    target->clGetCommandQueueInfo(queue, CL_QUEUE_DEVICE, sizeof(device), &device, NULL);
    for (int number = 0; number < kDevices; ++number) {
        cl_device_id known = NULL;
        if (atomic_compare_exchange_strong(&devices[number], &known, device) || known == device) return number;
    }
    return kDevices;
}

static int fails(struct fault* fault, cl_command_queue queue) {
    const int is_its = (fault->context && context_of(queue) == fault->context) ||
                       (fault->device >= 0 && number_of(queue) == fault->device);
    return is_its && atomic_fetch_sub(&fault->calls_left, 1) <= 0;
}

static cl_int CL_API_CALL enqueue_kernel(cl_command_queue queue, cl_kernel kernel, cl_uint dimensions,
                                         const size_t* offset, const size_t* global, const size_t* local, cl_uint waits,
                                         const cl_event* wait_list, cl_event* event) {
    number_of(queue);
    if (fails(&kernels, queue)) return kernels.status;
    return target->clEnqueueNDRangeKernel(queue, kernel, dimensions, offset, global, local, waits, wait_list, event);
}

static int has_failed(cl_event event) {
    const int count = atomic_load(&failed_count);
    for (int index = 0; index < count && index < kEvents; ++index)
        if (atomic_load(&failed[index]) == event) return 1;
    return 0;
}

static cl_int CL_API_CALL enqueue_marker(cl_command_queue queue, cl_uint waits, const cl_event* wait_list,
                                         cl_event* event) {
    const cl_int status = target->clEnqueueMarkerWithWaitList(queue, waits, wait_list, event);
    if (status != CL_SUCCESS || !event || !fails(&markers, queue)) return status;
    const int index = atomic_fetch_add(&failed_count, 1);
    if (index >= kEvents) return CL_OUT_OF_HOST_MEMORY;
    target->clRetainEvent(*event); /* for ever: no other event gets its address */
    atomic_store(&failed[index], *event);
    return CL_SUCCESS;
}

static cl_int CL_API_CALL get_event_info(cl_event event, cl_event_info name, size_t size, void* value, size_t* needed) {
    const cl_int status = target->clGetEventInfo(event, name, size, value, needed);
    if (status == CL_SUCCESS && name == CL_EVENT_COMMAND_EXECUTION_STATUS && value && has_failed(event)) {
        cl_int* const execution = value;
        if (*execution == CL_COMPLETE) *execution = markers.status;
    }
    return status;
}

static cl_int CL_API_CALL wait_for_events(cl_uint count, const cl_event* events) {
    const cl_int status = target->clWaitForEvents(count, events);
    if (status != CL_SUCCESS) return status;
    for (cl_uint index = 0; index < count; ++index)
        if (has_failed(events[index])) return CL_EXEC_STATUS_ERROR_FOR_EVENTS_IN_WAIT_LIST;
    return CL_SUCCESS;
}

static void arm(struct fault* fault, cl_context context, int calls, cl_int status) {
    fault->context = context;
    atomic_store(&fault->calls_left, calls);
    fault->status = status;
}

void clarus_faults_fail_kernels(cl_context context, int calls, cl_int status) { arm(&kernels, context, calls, status); }

void clarus_faults_fail_markers(cl_context context, int calls, cl_int status) { arm(&markers, context, calls, status); }

void clarus_faults_end(void) {
    kernels.context = NULL;
    markers.context = NULL;
    clarus_faults_lose(NULL, 0, CL_SUCCESS);
}

CL_API_ENTRY cl_int CL_API_CALL clGetLayerInfo(cl_layer_info name, size_t size, void* value, size_t* needed) {
    static const char kName[] = "faults";
    const cl_layer_api_version version = CL_LAYER_API_VERSION_100;
    const int is_version = name == CL_LAYER_API_VERSION;
    const size_t bytes = is_version ? sizeof(version) : sizeof(kName);
    if (!is_version && name != CL_LAYER_NAME) return CL_INVALID_VALUE;
    if (value && size < bytes) return CL_INVALID_VALUE;
    if (value) memcpy(value, is_version ? (const void*)&version : kName, bytes);
    if (needed) *needed = bytes;
    return CL_SUCCESS;
}

CL_API_ENTRY cl_int CL_API_CALL clInitLayer(cl_uint entries, const struct _cl_icd_dispatch* below,
                                            cl_uint* entries_returned, const struct _cl_icd_dispatch** layer) {
    if (!below || !entries_returned || !layer || entries < sizeof(dispatch) / sizeof(void*)) return CL_INVALID_VALUE;
    const char* const asked = getenv("CLARUS_FAULTS");
    int calls = 0;
    if (asked && sscanf(asked, "markers %d %d", &markers.device, &calls) == 2) {
        atomic_store(&markers.calls_left, calls);
        markers.status = CL_OUT_OF_RESOURCES;
    }
    target = below;
    dispatch = *below;
    dispatch.clEnqueueNDRangeKernel = enqueue_kernel;
    dispatch.clEnqueueMarkerWithWaitList = enqueue_marker;
    dispatch.clGetEventInfo = get_event_info;
    dispatch.clWaitForEvents = wait_for_events;
    *entries_returned = sizeof(dispatch) / sizeof(void*);
    *layer = clarus_faults_count(&dispatch);
    return CL_SUCCESS;
}
