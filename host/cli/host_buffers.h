#pragma once

#include <cstddef>
#include <map>
#include <memory>

#include "cl/opencl.h"
#include "clarus/device.h"
#include "clarus/types.h"

namespace clarus::cli {

/// Buffers over memory of the host, for devices that share it: nothing is copied.
class HostBuffers {
  public:
    /// `memory` holds what buffers are made over, longer than they live.
    HostBuffers(Device device, std::shared_ptr<const void> memory);

    /// Puts a buffer over the image's `bytes` in place of its host memory. It is made the first time that an image lies
    /// there; each time the device is told that the host has written.
    void replace(Image& image, size_t bytes);

  private:
    Device device_;
    std::shared_ptr<const void> memory_;
    std::map<const void*, cl::Buffer> buffers_;
};

}  // namespace clarus::cli
