#include "clarus/error.h"
#include "input_file.h"
#include "pipelines/layer.h"
#include "pipelines/pipeline.h"

using namespace clarus;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    try {
        const auto model = io::Safetensors::read(input_file("model.safetensors", data, size));
        const pipelines::Pipeline& pipeline = pipelines::pipeline_of(model);
        pipelines::PipelineOptions options;
        for (const PipelineOption& option : pipelines::options_of(model, pipeline)) options[option.name] = option.usual;
        for (const Size render : {Size{8, 8}, Size{5, 1}})
            pipelines::check_requantization(
                model, pipeline.build(model, pipelines::scales_of(model, pipeline).smallest, render, options));
    } catch (const Error&) {
    }
    return 0;
}
