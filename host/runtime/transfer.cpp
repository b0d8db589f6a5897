#include "runtime/transfer.h"

#include <memory>
#include <utility>

namespace clarus::runtime {
namespace {

void CL_CALLBACK complete_other(cl_event, cl_int status, void* other) {
    const std::unique_ptr<cl::UserEvent> event(static_cast<cl::UserEvent*>(other));
    event->setStatus(status < 0 ? status : CL_COMPLETE);
}

cl::CommandQueue queue_of_its_own(const ocl::Context& context) {
    return cl::CommandQueue(context.context(), context.device(), CL_QUEUE_PROFILING_ENABLE);
}

/// Whether the end of a mapping can be enqueued before the mapping has been made. Rusticl of Mesa 22 refuses that.
bool unmaps_ahead(const cl::Context& context, const cl::CommandQueue& queue) {
    constexpr size_t kBytes = 4;
    const cl::Buffer buffer(context, CL_MEM_READ_WRITE, kBytes);
    cl::UserEvent gate(context);
    const std::vector<cl::Event> waits{gate};
    void* const mapped = queue.enqueueMapBuffer(buffer, CL_FALSE, CL_MAP_READ, 0, kBytes, &waits);
    const bool does = clEnqueueUnmapMemObject(queue(), buffer(), mapped, 0, nullptr, nullptr) == CL_SUCCESS;
    gate.setStatus(CL_COMPLETE);
    queue.finish();
    if (!does) queue.enqueueUnmapMemObject(buffer, mapped);
    queue.finish();
    return does;
}

}  // namespace

cl::Event event_in(const cl::Context& context, const cl::Event& event) {
    if (event.getInfo<CL_EVENT_CONTEXT>()() == context()) return event;
    auto other = std::make_unique<cl::UserEvent>(context);
    cl::Event result(*other);
    cl::Event(event).setCallback(CL_COMPLETE, complete_other, other.get());
    static_cast<void>(other.release());  // the callback's
    if (const cl::CommandQueue queue = event.getInfo<CL_EVENT_COMMAND_QUEUE>(); queue()) queue.flush();
    return result;
}

Transfer::Transfer(const ocl::Context& from, const ocl::Context& to, size_t bytes, std::string name, bool profile)
    : from_(from.context()),
      to_(to.context()),
      source_queue_(queue_of_its_own(from)),
      destination_queue_(queue_of_its_own(to)),
      bytes_(bytes),
      staging_(unmaps_ahead(from.context(), source_queue_) ? 0 : bytes),
      profiler_(profile),
      stage_(profiler_.add_stage(std::move(name), "copy", 0, static_cast<double>(bytes))) {}

void Transfer::finish() {
    clFinish(destination_queue_());
    clFinish(source_queue_());
}

Transfer::Ends Transfer::enqueue(const cl::Buffer& source, const cl::Buffer& destination,
                                 const std::vector<cl::Event>& source_waits,
                                 const std::vector<cl::Event>& destination_waits) {
    if (!staging_.empty()) return enqueue_staged(source, destination, source_waits, destination_waits);
    cl::Event mapped, written, unmapped;
    void* const pixels =
        source_queue_.enqueueMapBuffer(source, CL_FALSE, CL_MAP_READ, 0, bytes_, &source_waits, &mapped);
    try {
        written = enqueue_writing(destination, pixels, mapped, destination_waits);
        const std::vector<cl::Event> after_writing{event_in(from_, written)};
        source_queue_.enqueueUnmapMemObject(source, pixels, &after_writing, &unmapped);
        source_queue_.flush();
    } catch (...) {
        finish();
        clEnqueueUnmapMemObject(source_queue_(), source(), pixels, 0, nullptr, nullptr);
        throw;
    }
    return {unmapped, written};
}

Transfer::Ends Transfer::enqueue_staged(const cl::Buffer& source, const cl::Buffer& destination,
                                        const std::vector<cl::Event>& source_waits,
                                        const std::vector<cl::Event>& destination_waits) {
    std::vector<cl::Event> waits = source_waits;
    if (staging_free_() && staging_free_.getInfo<CL_EVENT_COMMAND_EXECUTION_STATUS>() >= 0)  // else it failed
        waits.push_back(event_in(from_, staging_free_));
    cl::Event read;
    source_queue_.enqueueReadBuffer(source, CL_FALSE, 0, bytes_, staging_.data(), &waits, &read);
    staging_free_ = enqueue_writing(destination, staging_.data(), read, destination_waits);
    return {read, staging_free_};
}

cl::Event Transfer::enqueue_writing(const cl::Buffer& destination, const void* pixels, const cl::Event& there,
                                    std::vector<cl::Event> waits) {
    waits.push_back(event_in(to_, there));
    cl::Event written;
    cl::Event* const profiled = profiler_.event(stage_);
    destination_queue_.enqueueWriteBuffer(destination, CL_FALSE, 0, bytes_, pixels, &waits, &written);
    destination_queue_.flush();
    if (profiled) *profiled = written;
    return written;
}

}  // namespace clarus::runtime
