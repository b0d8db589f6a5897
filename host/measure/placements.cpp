#include "measure/placements.h"

#include <fmt/format.h>

#include <algorithm>
#include <future>
#include <memory>

#include "base/error.h"
#include "measure/statistics.h"
#include "measure/test_sequence.h"
#include "measure/timed_upscaler.h"

namespace clarus::measure {
namespace {

/// The test sequence in host memory, twice each frame's output, so that two frames may be under way.
class Running {
  public:
    Running(const Device& devices, const Model& model, Size render, const std::string& rules,
            const std::vector<TestFrame>& frames, bool profile = false)
        : upscaler_(devices, model, render, options_of(rules, profile)), frames_(frames) {
        upscaler_.prepare();
        const Size output = upscaler_.output_size();
        for (std::vector<float>& each : outputs_) each.resize(size_t{3} * output.width * output.height);
        turn();  // whatever is done at first
    }

    const Upscaler& upscaler() const { return upscaler_; }

    /// Of frames that are enqueued before those before them are done.
    std::vector<StageProfile> profile() {
        upscaler_.take_profile();
        frames_on_their_way();
        return upscaler_.take_profile();
    }

    struct Times {
        double latency, period;
    };
    Times turn() {
        std::vector<double> latencies;
        for (int index = 0; index < kSequenceFrames; ++index) {
            const double start = now();
            submit(index).wait();
            if (index > 0) latencies.push_back(now() - start);
        }
        return {median(latencies), frames_on_their_way()};
    }

    /// Seconds from frame to frame.
    double frames_on_their_way() {
        submit(0).wait();
        const double start = now();
        constexpr int kRounds = 3;
        std::vector<FrameEvent> events;
        for (int round = 0; round < kRounds; ++round)
            for (int index = 1; index < kSequenceFrames; ++index) {
                events.push_back(submit(index));
                // One frame more than there are outputs would have two write to one.
                if (events.size() >= 2) events[events.size() - 2].wait();
            }
        events.back().wait();
        return (now() - start) / static_cast<double>(events.size());
    }

  private:
    static UpscalerOptions options_of(const std::string& rules, bool profile) {
        UpscalerOptions options;
        options.placement = rules;
        options.profile = profile;
        return options;
    }

    FrameEvent submit(int index) {
        TestFrame& frame = frames_[index];
        const Size render = upscaler_.render_size();
        FrameDescription description;
        description.color = {.host = frame.color.data(), .size = render};
        description.depth = {.host = frame.depth.data(), .size = render};
        description.motion = {.host = frame.motion.data(), .size = render};
        description.jitter = frame.jitter;
        description.reset = index == 0;
        description.output = {.host = outputs_[submitted_++ % 2].data(), .size = upscaler_.output_size()};
        return upscaler_.submit(description);
    }

    Upscaler upscaler_;
    std::vector<TestFrame> frames_;
    std::vector<float> outputs_[2];
    size_t submitted_ = 0;
};

struct Together {
    double period, fairness;
};

/// As many frames of each, on a thread of its own.
Together run_together(Running& first, const std::vector<std::unique_ptr<Running>>& others) {
    std::vector<std::future<double>> periods;
    for (const std::unique_ptr<Running>& other : others)
        periods.push_back(std::async(std::launch::async, [&] { return other->frames_on_their_way(); }));
    double shortest = first.frames_on_their_way(), longest = shortest;
    for (std::future<double>& period : periods) {
        const double seconds = period.get();
        shortest = std::min(shortest, seconds);
        longest = std::max(longest, seconds);
    }
    return {longest / static_cast<double>(1 + others.size()), shortest / longest};
}

struct Named {
    std::string name, rules;
};

std::vector<Named> cuts(const std::vector<std::string>& stages) {
    std::vector<Named> result;
    for (size_t first = 1; first < stages.size(); ++first) {
        std::string before, after;
        for (size_t stage = 0; stage < stages.size(); ++stage)
            (stage < first ? before : after) += stages[stage] + "=1,";
        result.push_back({fmt::format("1 from {}", stages[first]), after});
        result.push_back({fmt::format("1 before {}", stages[first]), before});
    }
    return result;
}

}  // namespace

std::vector<PlacementResult> measure_placements(const Device& devices, const Model& model, Size render,
                                                const PlacementOptions& options,
                                                const std::function<void(double)>& progress) {
    const size_t count = devices.profiles().size();
    if (count < 2 && options.streams < 2)
        fail(ErrorKind::invalid_argument,
             "placements are of several devices, between commas: \"cpu/1, cpu/1=dsp\"; of one, --streams 2 or more can "
             "be measured");
    if (count < 2 && (options.every_cut || !options.rules.empty()))
        fail(ErrorKind::invalid_argument, "--placement is for several devices, and there is one");
    std::vector<TestFrame> frames;
    for (int index = 0; index < kSequenceFrames; ++index) frames.push_back(test_frame(render, index));

    const std::string by_default = UpscalerOptions().placement;
    Running alone(devices, model, render, count < 2 ? by_default : "", frames);
    std::vector<std::string> stages;
    for (const PlacedPart& part : alone.upscaler().placement())
        for (const std::string& stage : part.stages)
            if (std::find(stages.begin(), stages.end(), stage) == stages.end()) stages.push_back(stage);

    std::vector<Named> placements;
    for (size_t device = 0; device < count; ++device)
        placements.push_back({fmt::format("all on {}", device), count < 2 ? by_default : fmt::format("*={}", device)});
    if (count > 1) placements.push_back({"auto", "auto"});
    if (!options.rules.empty()) placements.push_back({options.rules, options.rules});
    if (options.every_cut)
        for (Named& cut : cuts(stages)) placements.push_back(std::move(cut));

    std::vector<PlacementResult> results;
    for (const Named& placement : placements) {
        if (progress) progress(static_cast<double>(results.size()) / static_cast<double>(placements.size()));
        Running running(devices, model, render, placement.rules, frames);
        std::vector<double> latencies, periods, ratios;
        // "auto" may choose another placement when it measures again.
        std::string rules = count < 2 ? by_default : "";
        for (const PlacedPart& part : running.upscaler().placement())
            for (const std::string& stage : part.stages) rules += fmt::format("{}={},", stage, part.device);
        std::vector<std::unique_ptr<Running>> others;
        for (int stream = 1; stream < options.streams; ++stream)
            others.push_back(std::make_unique<Running>(devices, model, render, rules, frames));
        std::vector<double> together, fairness;
        for (int turn = 0; turn < options.turns; ++turn) {
            const Running::Times reference = alone.turn(), times = running.turn();
            latencies.push_back(times.latency);
            periods.push_back(times.period);
            ratios.push_back(times.period / reference.period);
            if (others.empty()) continue;
            const Together both = run_together(running, others);
            together.push_back(both.period / reference.period);
            fairness.push_back(both.fairness);
        }
        results.push_back({.name = placement.name,
                           .parts = running.upscaler().placement(),
                           .latency = median(latencies),
                           .period = median(periods),
                           .period_ratio = median(ratios),
                           .stages = {}});
        if (!others.empty()) {
            results.back().together_ratio = median(together);
            results.back().fairness = median(fairness);
        }
        if (!options.profiles) continue;
        results.back().stages = Running(devices, model, render, rules, frames, true).profile();
    }
    return results;
}

}  // namespace clarus::measure
