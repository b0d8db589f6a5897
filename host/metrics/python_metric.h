#pragma once

#include <optional>

#include "base/python_process.h"
#include "io/image.h"

namespace clarus::metrics {

/// A metric that a Python package computes: how it is called, and what to do where it is missing.
struct PythonPackage {
    const char* metric;
    const char* prepare;  // Python: imports, and defines measure(image, reference) of float32 arrays [height, width, 3]
    const char* how_to_get;
};

/// NVIDIA's FLIP (Andersson et al. 2020; PyPI's flip-evaluator): the mean over the pixels, 0 (no difference) to 1, at
/// the package's default viewing distance.
extern const PythonPackage flip_package;

/// LPIPS (Zhang et al. 2018; PyPI's lpips), AlexNet's, from 0 (no difference). The backbone's weights are
/// torchvision's, and must be on this machine: they are not fetched.
extern const PythonPackage lpips_package;

/// A package's metric in a python3 that runs as long as this lives.
class PythonMetric {
  public:
    /// Errors: invalid_argument where there is no python3, or that has not what the package needs.
    explicit PythonMetric(const PythonPackage& package);

    /// Of display values. Errors: as mean_squared_error; file where python3 ends.
    double measure(const io::Pixels& image, const io::Pixels& reference);

  private:
    const PythonPackage& package_;
    std::optional<PythonProcess> python_;  // always, but while it is made
};

}  // namespace clarus::metrics
