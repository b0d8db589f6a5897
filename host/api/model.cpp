#include "clarus/model.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <sstream>

#include "api/build_graph.h"
#include "base/error.h"
#include "base/nearest.h"
#include "base/place.h"
#include "io/onnx.h"
#include "io/safetensors.h"
#include "pipelines/layer.h"
#include "pipelines/pipeline.h"
#include "pipelines/stack/onnx.h"

namespace clarus {
namespace {

namespace fs = std::filesystem;

/// Folders to look for shipped models in: $CLARUS_MODEL_PATH, then the one that comes with Clarus.
std::vector<fs::path> model_folders() {
    std::vector<fs::path> folders;
    const char* list = std::getenv("CLARUS_MODEL_PATH");
    std::istringstream stream(list ? list : "");
    for (std::string folder; std::getline(stream, folder, ':');)
        if (!folder.empty()) folders.emplace_back(folder);
    folders.push_back(data_folder() / "models");
    return folders;
}

std::vector<fs::path> shipped_models() {
    std::vector<fs::path> files;
    for (const fs::path& folder : model_folders()) {
        std::error_code error;
        for (const fs::directory_entry& entry : fs::directory_iterator(folder, error))
            if (entry.path().extension() == ".safetensors") files.push_back(entry.path());
    }
    std::stable_sort(files.begin(), files.end(),
                     [](const fs::path& a, const fs::path& b) { return a.stem() < b.stem(); });
    return files;
}

const pipelines::FilterPipeline* find_filter(std::string_view name) {
    const auto all = pipelines::filters();
    const auto found = std::ranges::find(all, name, &pipelines::FilterPipeline::name);
    return found == all.end() ? nullptr : &*found;
}

/// Where shipped models were looked for, if there are none at all.
std::string without_models() {
    if (!shipped_models().empty()) return "";
    std::string folders;
    for (const fs::path& folder : model_folders()) folders += (folders.empty() ? "" : ", ") + folder.string();
    return fmt::format(". No model files are in {} (Debian: apt install clarus-models; CLARUS_MODEL_PATH names others)",
                       folders);
}

std::string joined(const std::vector<std::string>& names) {
    std::string text;
    for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
    return text;
}

}  // namespace

struct Model::State {
    std::string name, pipeline;
    double scale = 1;
    ScaleRange scales{1, 1};
    std::optional<io::Safetensors> tensors;
    std::map<std::string, std::string> metadata;
    std::vector<PipelineOption> options;
};

std::string PipelineOption::range() const {
    return fmt::format("{}from {:g} to {:g}", whole ? "a whole number " : "", smallest, largest);
}

Model Model::load(const std::string& path, double scale) {
    auto state = std::make_shared<State>();
    state->tensors = io::is_onnx(path) ? pipelines::stack_of(io::read_onnx(path)) : io::Safetensors::read(path);
    state->name = fs::path(path).stem().string();
    pipelines::refuse_misspelt_metadata(*state->tensors);
    const pipelines::Pipeline& pipeline = pipelines::pipeline_of(*state->tensors);
    state->pipeline = pipeline.name;
    state->scales = pipelines::scales_of(*state->tensors, pipeline);
    state->scale = state->scales.is_single() ? state->scales.smallest : scale;
    if (!state->scales.contains(state->scale))
        fail(ErrorKind::invalid_argument, "{}: scale {}; this model's are from {} to {}", path, scale,
             state->scales.smallest, state->scales.largest);
    state->metadata = state->tensors->metadata();
    state->options = pipelines::options_of(*state->tensors, pipeline);
    Model model(std::move(state));
    // Whether the tensors fit does not depend on the size; say so now rather than at the first use.
    constexpr Size kSmall{8, 8};
    pipelines::check_requantization(*model.tensors(), build_graph(model, kSmall, output_size(kSmall, model.scale())));
    return model;
}

Model Model::filter(const std::string& name, double scale) {
    const pipelines::FilterPipeline* filter = find_filter(name);
    if (!filter) fail(ErrorKind::invalid_argument, "no filter is named \"{}\"; there are: {}", name, joined(names()));
    if (!std::isfinite(scale) || scale < 1)
        fail(ErrorKind::invalid_argument, "scale {}: a filter's scale is at least 1", scale);
    auto state = std::make_shared<State>();
    state->name = state->pipeline = name;
    state->scale = scale;
    state->scales = {1, std::numeric_limits<double>::infinity()};
    state->options = filter->options;
    return Model(std::move(state));
}

Model Model::find(const std::string& name_or_path, double scale) {
    if (find_filter(name_or_path)) return filter(name_or_path, scale);
    const bool is_path = name_or_path.find('/') != std::string::npos || fs::path(name_or_path).has_extension();
    if (is_path) return load(name_or_path, scale);
    for (const fs::path& file : shipped_models())
        if (file.stem() == name_or_path) return load(file.string(), scale);
    const std::vector<std::string> known = names();
    const std::vector<std::string_view> views(known.begin(), known.end());
    const std::string_view meant = nearest(name_or_path, views);
    if (!meant.empty())
        fail(ErrorKind::invalid_argument, "no model is named \"{}\"; is it {}? There are: {}{}", name_or_path, meant,
             joined(known), without_models());
    fail(ErrorKind::invalid_argument, "no model is named \"{}\"; there are: {}; or give a .safetensors or .onnx file{}",
         name_or_path, joined(known), without_models());
}

std::vector<std::string> Model::names() {
    std::vector<std::string> names;
    for (const fs::path& file : shipped_models())
        if (names.empty() || names.back() != file.stem()) names.push_back(file.stem().string());
    for (const pipelines::FilterPipeline& filter : pipelines::filters()) names.emplace_back(filter.name);
    return names;
}

const std::string& Model::name() const { return state_->name; }
const std::string& Model::pipeline() const { return state_->pipeline; }
double Model::scale() const { return state_->scale; }
ScaleRange Model::scales() const { return state_->scales; }
const std::map<std::string, std::string>& Model::metadata() const { return state_->metadata; }
const std::vector<PipelineOption>& Model::options() const { return state_->options; }
const io::Safetensors* Model::tensors() const { return state_->tensors ? &*state_->tensors : nullptr; }

}  // namespace clarus
