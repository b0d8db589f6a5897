#include "cli/host_buffers.h"

#include <utility>

#include "cl/context.h"
#include "cl/error.h"

namespace clarus::cli {

HostBuffers::HostBuffers(Device device, std::shared_ptr<const void> memory)
    : device_(std::move(device)), memory_(std::move(memory)) {}

void HostBuffers::replace(Image& image, size_t bytes) {
    if (!image.host) return;
    ocl::checked("share a frame's memory with the device", [&] {
        cl::Buffer& buffer = buffers_[image.host];
        if (!buffer())
            buffer = cl::Buffer(device_.context().context(), CL_MEM_READ_ONLY | CL_MEM_USE_HOST_PTR, bytes, image.host);
        // Invalidating keeps the device from writing its old copy, if it has one, over what the renderer wrote.
        const cl::CommandQueue& queue = device_.context().queue();
        void* mapped = queue.enqueueMapBuffer(buffer, CL_FALSE, CL_MAP_WRITE_INVALIDATE_REGION, 0, bytes);
        queue.enqueueUnmapMemObject(buffer, mapped);
        image.buffer = buffer();
        image.host = nullptr;
    });
}

}  // namespace clarus::cli
