#pragma once

/* What a test asks of the layer, which the OpenCL loader loads where OPENCL_LAYERS names it; to be found by dlsym. For
   a process of its own, CLARUS_FAULTS="markers DEVICE CALLS" in its environment asks for failing markers with status
   CL_OUT_OF_RESOURCES: DEVICE counts devices from 0 as kernels are first enqueued on them. */

#include <CL/cl.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The call of clEnqueueNDRangeKernel on a queue of this context that comes after `calls` others, and all after that,
   return `status`. */
void clarus_faults_fail_kernels(cl_context context, int calls, cl_int status);

/* The call of clEnqueueMarkerWithWaitList on a queue of this context that comes after `calls` others, and all after
   that, succeed, and their events end with `status`. */
void clarus_faults_fail_markers(cl_context context, int calls, cl_int status);

/* The device of this context is lost in the call that comes after `calls` others, of those that take one of its queues
   or wait for its events: it and all after it return `status`, and none of the context's events has ended well. */
void clarus_faults_lose(cl_context context, int calls, cl_int status);

/* From now on nothing fails. */
void clarus_faults_end(void);

#ifdef __cplusplus
}
#endif
