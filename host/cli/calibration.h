#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "clarus/device.h"
#include "clarus/model.h"
#include "cli/quantizer.h"
#include "io/sequence.h"

namespace clarus::cli {

/// A sequence that a model is calibrated with, and where it was read from.
struct CalibrationSequence {
    std::string path;
    io::Sequence sequence;
};

/// Runs models over sequences, to see what their layers read and what they make.
class Calibration {
  public:
    /// Outputs of the frames that comparisons are made at.
    using Outputs = std::vector<io::Pixels>;
    using Progress = std::function<void(size_t frame, size_t frames)>;

    Calibration(Device device, std::vector<CalibrationSequence> sequences);

    /// Opens every image. Errors: file, naming it.
    void check(const Model& model) const;

    /// What those layers read. `kernels`: pixels along each side of their kernels, by name. Errors: those of Upscaler.
    std::map<std::string, LayerSamples> samples(const Model& model, const std::map<std::string, int>& kernels,
                                                const Progress& progress) const;

    Outputs outputs(const Model& model, const Progress& progress) const;

    /// PSNR of one model's outputs as those of another, in dB.
    static double psnr(const Outputs& outputs, const Outputs& reference);

  private:
    size_t frames() const;

    Device device_;
    std::vector<CalibrationSequence> sequences_;
};

}  // namespace clarus::cli
