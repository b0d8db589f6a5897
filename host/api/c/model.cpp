#include "clarus/model.h"

#include <cstddef>
#include <string>
#include <vector>

#include "api/c/guard.h"
#include "api/c/handles.h"
#include "clarus/clarus.h"

using namespace clarus::c;

extern "C" {

clarus_status clarus_model_find(const char* name_or_path, double scale, clarus_model** model) {
    return guarded([&] {
        clarus_model*& found = given(model, "model");
        found = new clarus_model{clarus::Model::find(&given(name_or_path, "name_or_path"), scale)};
    });
}

clarus_status clarus_model_names(clarus_list** names) { return list_of(names, clarus::Model::names); }

const char* clarus_model_name(const clarus_model* model) { return model ? model->model.name().c_str() : nullptr; }

const char* clarus_model_pipeline(const clarus_model* model) {
    return model ? model->model.pipeline().c_str() : nullptr;
}

double clarus_model_scale(const clarus_model* model) { return model ? model->model.scale() : 0; }

void clarus_model_scales(const clarus_model* model, double* smallest, double* largest) {
    const clarus::ScaleRange scales = model ? model->model.scales() : clarus::ScaleRange{0, 0};
    if (smallest) *smallest = scales.smallest;
    if (largest) *largest = scales.largest;
}

clarus_status clarus_model_metadata_keys(const clarus_model* model, clarus_list** keys) {
    return list_of(keys, [&] {
        std::vector<std::string> words;
        for (const auto& [key, value] : given(model, "model").model.metadata()) words.push_back(key);
        return words;
    });
}

const char* clarus_model_metadata(const clarus_model* model, const char* key) {
    if (!model || !key) return nullptr;
    const auto found = model->model.metadata().find(key);
    return found == model->model.metadata().end() ? nullptr : found->second.c_str();
}

size_t clarus_model_option_count(const clarus_model* model) { return model ? model->model.options().size() : 0; }

clarus_option_description clarus_model_option(const clarus_model* model, size_t index) {
    if (index >= clarus_model_option_count(model)) return {};
    const clarus::PipelineOption& option = model->model.options()[index];
    return {option.name.c_str(), option.help.c_str(), option.smallest, option.largest, option.usual, option.whole};
}

void clarus_model_release(clarus_model* model) { delete model; }

}  // extern "C"
