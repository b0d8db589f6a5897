#pragma once

#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "clarus/export.h"

namespace clarus {

namespace io {
class Safetensors;
}

/// The scales that a model can upscale by.
struct ScaleRange {
    double smallest, largest;  // that of filters is infinite

    bool contains(double scale) const { return scale >= smallest && scale <= largest; }
    bool is_single() const { return smallest == largest; }
};

/// A setting that pipelines have of their own: UpscalerOptions::pipeline_options sets it by name.
struct PipelineOption {
    std::string name;  // "previous_frames"; on the command line --previous-frames
    std::string help;  // one line
    double smallest, largest;
    double usual;        // its value unless told
    bool whole = false;  // whole numbers only
    /// A model's metadata of that name is its largest and its usual value. In Model::options it already is.
    bool limited_by_model = false;

    /// What values it takes, in words: "from 0 to 1".
    CLARUS_API std::string range() const;
};

/// What is to be computed: a network with its weights, or a filter. A handle: copies share the weights.
class CLARUS_API Model {
  public:
    /// A `.safetensors` file (docs/formats.md, "A model"), or a network of one frame in ONNX form, a `.onnx` file
    /// ("ONNX networks" there), which programs other than `clarus` cannot read: `clarus model` makes the first of it.
    /// `scale` is used where the model has no scale of its own: its metadata `scale` is "any", or it was published
    /// without metadata, as Arm's NSS is (docs/nss.md). Errors: file, naming the tensor or key and what was expected;
    /// invalid_argument, naming a scale that the model does not have.
    static Model load(const std::string& path, double scale = 2);

    /// A filter without a network: "nearest", "bilinear", "bicubic", "lanczos", "fsr1", "fsr2". `scale` is any real
    /// number from 1; output sides end at 2^15 pixels.
    static Model filter(const std::string& name, double scale);

    /// A shipped model's or a filter's name, or a path. `scale` is used by filters and by models without a scale of
    /// their own.
    static Model find(const std::string& name_or_path, double scale = 2);

    /// Names that `find` knows: shipped models, then filters. Shipped models are looked for in $CLARUS_MODEL_PATH
    /// (folders separated by ':'), then where Clarus was built or installed.
    static std::vector<std::string> names();

    const std::string& name() const;      // the file's stem, or the filter's name
    const std::string& pipeline() const;  // "enss", "bilinear", …
    double scale() const;
    ScaleRange scales() const;  // a single one for a model that has its own
    const std::map<std::string, std::string>& metadata() const;
    const std::vector<PipelineOption>& options() const;  // those that its pipeline has

    /// The tensors of a model file; null for a filter.
    const io::Safetensors* tensors() const;

  private:
    struct State;
    explicit Model(std::shared_ptr<const State> state) : state_(std::move(state)) {}
    std::shared_ptr<const State> state_;
};

}  // namespace clarus
