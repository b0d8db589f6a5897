#pragma once

#include <initializer_list>
#include <map>
#include <memory>

#include "cl/opencl.h"
#include "clarus/device.h"
#include "clarus/types.h"

namespace clarus::cli {

/// Buffers over memory of the host, for devices that share it: nothing is copied.
class HostBuffers {
  public:
    /// `memory` holds what buffers are made over, longer than they live. Errors: device.
    HostBuffers(const Device& device, std::shared_ptr<const void> memory);

    /// Puts buffers over the images in place of their host memory, and tells the device that the host has written
    /// there. A buffer is made the first time that an image lies there. Those without host memory stay as they are.
    /// Errors: device.
    void replace(std::initializer_list<Image*> images);

  private:
    std::shared_ptr<const void> memory_;
    cl::Context context_;
    cl::CommandQueue queue_;  // not the frames': what is told here must not wait for the frame before
    std::map<const void*, cl::Buffer> buffers_;
};

}  // namespace clarus::cli
