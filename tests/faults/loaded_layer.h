#pragma once

#include <dlfcn.h>
#include <doctest/doctest.h>

#include <cstdlib>

#include "cl/context.h"
#include "layer.h"
#include "test_device.h"

namespace clarus::test {

/// The layer of faults, which the OpenCL loader has loaded.
class Faults {
  public:
    Faults() {
        const char* const path = std::getenv("OPENCL_LAYERS");
        REQUIRE_MESSAGE(path, "OPENCL_LAYERS is to name the layer of faults, as ctest has it");
        test_device();  // the loader loads layers at the first call
        layer_ = dlopen(path, RTLD_LAZY | RTLD_NOLOAD);
        REQUIRE_MESSAGE(layer_, "the OpenCL loader knows no layers");
    }
    ~Faults() {
        reinterpret_cast<decltype(&clarus_faults_end)>(dlsym(layer_, "clarus_faults_end"))();
        dlclose(layer_);
    }
    Faults(const Faults&) = delete;
    Faults& operator=(const Faults&) = delete;

    void fail_kernels(const Device& devices, int device, int calls) const {
        fail("clarus_faults_fail_kernels", devices, device, calls);
    }
    void fail_markers(const Device& devices, int device, int calls) const {
        fail("clarus_faults_fail_markers", devices, device, calls);
    }
    void lose(const Device& device, int calls) const {
        fail("clarus_faults_lose", device, 0, calls, CL_DEVICE_NOT_AVAILABLE);
    }

  private:
    void fail(const char* name, const Device& devices, int device, int calls,
              cl_int status = CL_OUT_OF_RESOURCES) const {
        const auto function = reinterpret_cast<decltype(&clarus_faults_fail_kernels)>(dlsym(layer_, name));
        if (!function) FAIL(name);
        function(devices.contexts()[device]->context()(), calls, status);
    }

    void* layer_;
};

}  // namespace clarus::test
