#pragma once

#include <CL/cl_layer.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The calls that Clarus makes, which go on to `below`: they are counted, and fail as CLARUS_FAULTS (fault.h) or
   clarus_faults_lose asks; what is released or retained never does. At the process's end the file that
   CLARUS_FAULTS_COUNTS names is told how many there were of each name, and, as "left:KIND", what they made and nobody
   released. To be called once; the result lives for ever. */
const struct _cl_icd_dispatch* clarus_faults_count(const struct _cl_icd_dispatch* below);

#ifdef __cplusplus
}
#endif
