#pragma once

#include <sys/types.h>

#include <string>

#include "io/image.h"

namespace clarus::metrics {

/// NVIDIA's FLIP (Andersson et al. 2020; PyPI's flip-evaluator) in a python3 that runs as long as this lives.
class Flip {
  public:
    /// Errors: invalid_argument where there is no python3, or that has no flip_evaluator.
    Flip();
    ~Flip();
    Flip(const Flip&) = delete;
    Flip& operator=(const Flip&) = delete;

    /// The mean over the pixels, 0 (no difference) to 1, at the package's default viewing distance. Errors: as
    /// mean_squared_error; file where python3 ends.
    double mean(const io::Pixels& image, const io::Pixels& reference);

  private:
    void send(const void* data, size_t bytes);
    std::string receive_line();

    int socket_ = -1;
    pid_t python_ = -1;
};

}  // namespace clarus::metrics
