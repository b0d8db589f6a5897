#pragma once

#include <atomic>
#include <future>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "cl/disk_cache.h"
#include "cl/kernel_source.h"
#include "cl/opencl.h"
#include "clarus/device.h"

namespace clarus::ocl {

/// A unit of a program: its kernels' names are those of name_in_unit(…, unit).
struct UnitPlace {
    cl::Program program;
    size_t unit = 0;
};

/// A device, an OpenCL context on it, an in-order queue, and the programs built for it. Programs are kept in memory and
/// on disk; where the driver keeps them itself, what is on disk only says that it has them. Thread-safe; two threads
/// may build different programs at once.
class Context {
  public:
    /// In a context that has the device, with a queue of its own that has profiling enabled.
    Context(cl::Context context, cl::Device device, DeviceProfile profile);

    /// The caller's context and queue. Where the queue is out of order, an in-order one is made in the same context.
    Context(cl::Context context, cl::Device device, cl::CommandQueue queue, DeviceProfile profile);

    Context(const Context&) = delete;
    Context& operator=(const Context&) = delete;

    /// The same device in the same OpenCL context, with another queue and the same programs.
    std::shared_ptr<Context> with_another_queue() const;

    const DeviceProfile& profile() const { return profile_; }
    const cl::Device& device() const { return device_; }
    const cl::Context& context() const { return context_; }
    const cl::CommandQueue& queue() const { return queue_; }

    /// Whether what one makes the other reads where it is.
    bool shares_memory_with(const Context& other) const { return context_() == other.context_(); }

    /// Whether queue() is the one that a caller handed to Device::adopt.
    bool queue_is_callers() const { return queue_is_callers_; }
    /// Whether events of queue() carry times; a caller's queue may have been made without.
    bool queue_has_profiling() const { return queue_has_profiling_; }

    /// One program of several files for several options (program_text). Errors: build, with the compiler's log.
    cl::Program program(std::span<const ProgramUnit> units);
    /// Where the kernels of each unit are: in programs that this context has already, else in one program of all that
    /// none has; or in the program of all of them, where that is on disk. Errors: as program().
    std::vector<UnitPlace> places(std::span<const ProgramUnit> units);
    /// Of the kernel file `file`.cl alone, whose kernels keep their names. Errors: also invalid_argument where there is
    /// no such file.
    cl::Program program(std::string_view file, std::string_view options);
    /// The same of source text made at run time. `name` stands for it in messages.
    cl::Program program_from_source(std::string_view name, std::string_view source, std::string_view options);

    /// Writes what was compiled since the last call to the disk cache. To be called once the kernels have run for the
    /// first time: a driver may only then compile a kernel for its work-group size, and what it did goes along.
    void save_programs();

    /// How many programs this context has compiled: 0 where memory, disk and driver had them all.
    int programs_compiled() const { return programs_->compiled; }

  private:
    cl::Program load_or_compile(std::span<const ProgramUnit> units, const std::string& text, const CacheKey& key);
    cl::Program build(std::span<const ProgramUnit> units, const std::string& text);

    DeviceProfile profile_;
    cl::Device device_;
    cl::Context context_;
    cl::CommandQueue queue_;
    bool queue_is_callers_ = false;
    bool queue_has_profiling_ = true;

    DiskCache disk_cache_;
    std::string identity_;  // of the device and its driver
    bool driver_keeps_programs_;
    /// Shared by all queues of the device in this context.
    struct Programs {
        std::mutex mutex;  // guards the maps
        std::map<CacheKey, std::shared_future<cl::Program>> programs;
        std::map<CacheKey, UnitPlace> units;  // of places()
        std::map<CacheKey, cl::Program> unsaved;
        std::atomic<int> compiled = 0;
    };
    std::shared_ptr<Programs> programs_ = std::make_shared<Programs>();
};

}  // namespace clarus::ocl
