#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "cl/context.h"
#include "runtime/profiler.h"

namespace clarus::runtime {

/// An event of `context` that completes, or fails, when `event` of any context does: `event` itself where it is of that
/// context. Its command is on its way to its device when this returns.
cl::Event event_in(const cl::Context& context, const cl::Event& event);

/// Copies buffers of one context to buffers of another, through the host. Neither device waits for the other's frame:
/// each end has a queue of its own.
class Transfer {
  public:
    /// `bytes` are copied each frame, `name` is their profile's.
    Transfer(const ocl::Context& from, const ocl::Context& to, size_t bytes, std::string name, bool profile);
    ~Transfer() { finish(); }
    Transfer(const Transfer&) = delete;
    Transfer& operator=(const Transfer&) = delete;

    /// Waits for what is on its way.
    void finish();

    struct Ends {
        cl::Event source_free;        // of the source's context: its buffer may be written again
        cl::Event destination_ready;  // of the destination's: its buffer may be read
    };
    /// Enqueues a copy. The source is read after `source_waits`, events of its context, the destination
    /// written after `destination_waits`, of its own. One copy where the source's memory can be mapped in place, two
    /// where the driver cannot enqueue that.
    Ends enqueue(const cl::Buffer& source, const cl::Buffer& destination, const std::vector<cl::Event>& source_waits,
                 const std::vector<cl::Event>& destination_waits);

    Profiler& profiler() { return profiler_; }

  private:
    Ends enqueue_staged(const cl::Buffer& source, const cl::Buffer& destination,
                        const std::vector<cl::Event>& source_waits, const std::vector<cl::Event>& destination_waits);
    /// Writes to the destination what is in host memory once that is there.
    cl::Event enqueue_writing(const cl::Buffer& destination, const void* pixels, const cl::Event& there,
                              std::vector<cl::Event> waits);

    cl::Context from_, to_;
    cl::CommandQueue source_queue_, destination_queue_;
    size_t bytes_;
    std::vector<std::byte> staging_;  // empty where the source is mapped
    cl::Event staging_free_;          // null before the first frame
    Profiler profiler_;
    int stage_;
};

}  // namespace clarus::runtime
