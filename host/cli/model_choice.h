#pragma once

#include <optional>
#include <string>

#include "clarus/model.h"
#include "clarus/upscaler.h"
#include "io/sequence.h"

namespace clarus::cli {

/// A model as a command line asks for it. A network has its scale, or else, as a filter does, takes the one asked for
/// or what suits the output. That is, from the first that is given: the output size asked for, the scale asked for,
/// what the frames' source says.
struct ModelWish {
    std::string model;
    std::optional<double> scale;
    std::optional<Size> output_size;
};

/// What is run, and the output size where that is not what the model makes.
struct ChosenModel {
    Model model;
    std::optional<Size> output_size;
};

/// At the scale asked for, or at 2 where it has none of its own. Errors: those of Model::find; invalid_argument where
/// its scale is another.
Model find_model(const ModelWish& wish);

/// For frames of this sequence, which may have none yet; `dynamic` where their size changes. `model` is what find_model
/// gives, `source` what messages call the sequence. Errors: invalid_argument where it upscales by another scale.
ChosenModel choose_model(Model model, const ModelWish& wish, const io::Sequence& sequence, bool dynamic,
                         const std::string& source);

/// The settings with what follows from the frames.
UpscalerOptions options_for(UpscalerOptions settings, const io::Sequence& sequence, bool dynamic,
                            const std::optional<Size>& output_size);

/// "2560x1440". Errors: CLI::ValidationError, naming the option.
Size parse_output_size(const std::string& text);

}  // namespace clarus::cli
