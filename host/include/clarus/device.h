#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "clarus/export.h"

typedef struct _cl_context* cl_context;
typedef struct _cl_device_id* cl_device_id;
typedef struct _cl_command_queue* cl_command_queue;

namespace clarus {

enum class DeviceClass { gpu, cpu, dsp };

/// What Clarus knows of a device and decides by; nothing in Clarus asks for a vendor's name.
struct DeviceProfile {
    std::string selector;  // "platform:device", what `Device::open` takes to get this one again
    std::string name, vendor, platform, driver_version, opencl_version;
    DeviceClass device_class = DeviceClass::cpu;
    bool simulator = false;  // there to find errors: how long it takes says nothing, and its compiler takes too much
    int compute_units = 1;
    int clock_mhz = 0;
    int float_vector_width = 1;  // native width in floats
    size_t max_work_group_size = 1;
    size_t global_memory = 0;                // bytes
    size_t max_allocation = 0;               // bytes
    size_t local_memory = 0;                 // bytes
    bool local_memory_is_dedicated = false;  // false where local memory is a part of global memory
    size_t memory_alignment = 1;             // bytes; what a sub-buffer's origin is a multiple of
    bool unified_memory = false;             // host and device share memory
    bool images = false;
    bool half_storage = false;      // vload_half and vstore_half compile (part of OpenCL 1.0; probed)
    bool half_arithmetic = false;   // cl_khr_fp16, or a kernel that computes in half compiles (probed)
    bool int8_dot_product = false;  // cl_khr_integer_dot_product
    bool vnni = false;              // takes x86's vpdpbusd on 512 bits as inline assembly, and can run it (probed)
    bool bf16 = false;              // likewise of vdpbf16ps: products of bfloat16, summed in float
    bool fast_fma = false;          // a fused multiply–add in hardware, as the compiler tells
    bool subgroups = false;
    bool sub_devices = false;      // can be partitioned into devices of fewer compute units
    bool gl_sharing = false;       // cl_khr_gl_sharing: textures and buffers of OpenGL become memory objects
    bool external_memory = false;  // cl_khr_external_memory: memory of Vulkan or Direct3D 12 does
};

/// Every device of every platform, in the order of their selectors. Empty where there is none.
/// Errors: no_device where the OpenCL loader finds no platform.
CLARUS_API std::vector<DeviceProfile> list_devices();

namespace ocl {
class Context;
}

/// A device with a context, a queue and a cache of compiled programs, or several that work on a network together
/// (StreamOptions::placement). A handle: copies mean the same device. Upscalers of one Device may
/// be used from several threads, each from one at a time (clarus/upscaler.h).
class CLARUS_API Device {
  public:
    /// `selector`: "auto" (a GPU, else a DSP, else a CPU; the most compute units first), a class ("gpu", "cpu", "dsp"),
    /// an index ("0:1": platform 0, device 1), a part of a name (case does not matter), and after any of them "/N" for
    /// a sub-device of N compute units ("cpu/1"), and after that "=CLASS" for a class that it is to be treated as:
    /// "cpu/1=dsp". Several between commas work together: "gpu, cpu"; sub-devices of one device are different parts of
    /// it. Devices of one platform share a context, and what one makes the other reads where it is. Errors: no_device,
    /// naming what there is; invalid_argument for a class that there is not, or a device named twice.
    static Device open(std::string_view selector = "auto");

    /// The caller's own objects, retained. Frames are enqueued on `queue`; where it is an out-of-order queue, on an
    /// in-order queue of the same context, ordered by the events of the frame description.
    static Device adopt(cl_context context, cl_device_id device, cl_command_queue queue);

    /// Devices that were opened or adopted one by one, in this order, to work together. What devices of different
    /// contexts make for each other is copied, and a frame's images must then be in host memory. Errors:
    /// invalid_argument where there is none.
    static Device together(const std::vector<Device>& devices);

    /// Of the only device, or of the first.
    const DeviceProfile& profile() const;
    /// Of all.
    std::vector<DeviceProfile> profiles() const;
    /// Whether all are of one OpenCL context, which callers' buffers can then be of.
    bool is_one_context() const;
    /// How many OpenCL programs have been compiled from source for them: 0 where the cache had them all.
    int programs_compiled() const;
    ocl::Context& context() const { return *contexts_.front(); }
    const std::vector<std::shared_ptr<ocl::Context>>& contexts() const { return contexts_; }

  private:
    explicit Device(std::vector<std::shared_ptr<ocl::Context>> contexts) : contexts_(std::move(contexts)) {}
    std::vector<std::shared_ptr<ocl::Context>> contexts_;
};

/// The folder that holds compiled programs and tuning results: $CLARUS_CACHE_DIR, else $XDG_CACHE_HOME/clarus, else
/// ~/.cache/clarus; empty where there is no such folder, and nothing is kept. Made when first written to, for its owner
/// alone; everything in it can be deleted at any time. What it holds decides what runs on the device, so that files and
/// folders of another user, or that others may write, are not used.
CLARUS_API std::string cache_directory();

}  // namespace clarus
