#include "cli/pipeline_options.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <string_view>

#include "pipelines/pipeline.h"

namespace clarus::cli {
namespace {

/// The pipelines that have an option of one name.
struct Declared {
    PipelineOption option;  // as the first of them declares it
    std::vector<std::string> pipelines;
    std::vector<std::string> usual;  // of each

    std::string usual_text() const {
        if (std::all_of(usual.begin(), usual.end(), [&](const std::string& each) { return each == usual.front(); }))
            return usual.front();
        std::vector<std::string> each;
        for (size_t i = 0; i < usual.size(); ++i) each.push_back(fmt::format("{} ({})", usual[i], pipelines[i]));
        return fmt::format("{}", fmt::join(each, ", "));
    }
};

void gather(std::vector<Declared>& all, std::string_view pipeline, const std::vector<PipelineOption>& options) {
    for (const PipelineOption& option : options) {
        auto found = std::find_if(all.begin(), all.end(),
                                  [&](const Declared& declared) { return declared.option.name == option.name; });
        if (found == all.end()) found = all.insert(all.end(), {option, {}, {}});
        found->pipelines.emplace_back(pipeline);
        found->usual.push_back(option.limited_by_model ? "the model's" : fmt::format("{:g}", option.usual));
    }
}

}  // namespace

std::string flag_of(std::string option) {
    std::replace(option.begin(), option.end(), '_', '-');
    return "--" + option;
}

std::vector<PipelineFlag> pipeline_flags() {
    std::vector<Declared> all;
    for (const pipelines::Pipeline& pipeline : pipelines::pipelines()) gather(all, pipeline.name, pipeline.options);
    for (const pipelines::FilterPipeline& filter : pipelines::filters()) gather(all, filter.name, filter.options);
    std::vector<PipelineFlag> flags;
    for (const Declared& each : all)
        flags.push_back({each.option.name, flag_of(each.option.name),
                         fmt::format("For {}: {}; {}, {} by default", fmt::join(each.pipelines, ", "), each.option.help,
                                     each.option.range(), each.usual_text())});
    return flags;
}

void add_pipeline_options(CLI::App& command, std::map<std::string, double>& chosen) {
    for (const PipelineFlag& flag : pipeline_flags())
        command
            .add_option_function<double>(
                flag.flag, [&chosen, name = flag.name](double value) { chosen[name] = value; }, flag.help)
            ->type_name("N");
}

}  // namespace clarus::cli
