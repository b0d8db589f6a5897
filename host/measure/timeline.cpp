#include "measure/timeline.h"

#include <algorithm>
#include <tuple>
#include <vector>

namespace clarus::measure {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kFrames = 5;

struct Run {
    double start, end;
    int frame;
    size_t stage;
};

}  // namespace

Json placement_json(std::span<const PlacedPart> placement) {
    Json parts = Json::array();
    for (const PlacedPart& part : placement) {
        Json inputs = Json::array();
        for (const PlacedPart::Input& input : part.inputs)
            inputs.push_back({{"part", input.part},
                              {"value", input.value},
                              {"frames_ago", input.frames_ago},
                              {"bytes", input.bytes}});
        parts.push_back({{"device", part.device},
                         {"stages", part.stages},
                         {"seconds", part.seconds},
                         {"bytes_in", part.bytes_in},
                         {"inputs", inputs}});
    }
    return parts;
}

Json stages_json(std::span<const StageProfile> stages) {
    Json json = Json::array();
    for (const StageProfile& stage : stages)
        json.push_back({{"name", stage.name},
                        {"kernel", stage.kernel},
                        {"device", stage.device},
                        {"seconds", stage.seconds},
                        {"operations", stage.operations},
                        {"bytes", stage.bytes}});
    return json;
}

Json timeline_json(std::span<const StageProfile> stages) {
    int last = -1;
    for (const StageProfile& stage : stages)
        for (const StageProfile::Span& span : stage.spans) last = std::max(last, span.frame);
    const int first = std::max(0, (last + 1 - kFrames) / 2);
    std::vector<Run> runs;
    for (size_t stage = 0; stage < stages.size(); ++stage)
        for (const StageProfile::Span& span : stages[stage].spans)
            if (span.frame >= first && span.frame < first + kFrames)
                runs.push_back({span.start, span.end, span.frame, stage});
    std::sort(runs.begin(), runs.end(),
              [](const Run& a, const Run& b) { return std::tie(a.start, a.stage) < std::tie(b.start, b.stage); });
    Json json = Json::array();
    for (const Run& run : runs)
        json.push_back({{"stage", run.stage},
                        {"frame", run.frame},
                        {"start", run.start - runs.front().start},
                        {"end", run.end - runs.front().start}});
    return json;
}

}  // namespace clarus::measure
