#include "cli/host_buffers.h"

#include <utility>

#include "cl/context.h"
#include "cl/error.h"

namespace clarus::cli {

HostBuffers::HostBuffers(const Device& device, std::shared_ptr<const void> memory)
    : memory_(std::move(memory)), context_(device.context().context()) {
    ocl::checked("make a queue", [&] { queue_ = cl::CommandQueue(context_, device.context().device()); });
}

void HostBuffers::replace(std::initializer_list<Image*> images) {
    ocl::checked("share a frame's memory with the device", [&] {
        for (Image* image : images) {
            if (!image->host) continue;
            const size_t bytes = image->row_pitch * image->size.height;
            cl::Buffer& buffer = buffers_[image->host];
            if (!buffer() || buffer.getInfo<CL_MEM_SIZE>() < bytes)  // of a frame that was smaller
                buffer = cl::Buffer(context_, CL_MEM_READ_ONLY | CL_MEM_USE_HOST_PTR, bytes, image->host);
            // Invalidating keeps the device from writing its old copy, if it has one, over what the renderer wrote.
            void* mapped = queue_.enqueueMapBuffer(buffer, CL_TRUE, CL_MAP_WRITE_INVALIDATE_REGION, 0, bytes);
            queue_.enqueueUnmapMemObject(buffer, mapped);
            image->buffer = buffer();
            image->host = nullptr;
        }
        queue_.finish();
    });
}

}  // namespace clarus::cli
