#include "measure/item_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "io/safetensors.h"

namespace clarus::measure {
namespace {

UpscalerOptions upscaler_options(Precision precision, Tuning tuning) {
    UpscalerOptions options;
    options.precision = precision;
    options.tuning = tuning;
    return options;
}

}  // namespace

ItemRun::ItemRun(const BenchItem& item, Tuning tuning, const Sketch* expected, ItemResult& result)
    : item_(item),
      expected_(expected),
      result_(result),
      upscaler_(item.device, item.model, item.render_size, upscaler_options(item.precision, tuning)) {
    result_.memory = upscaler_.memory();
    if (expected_)
        result_.check.tolerance = tolerance(item.precision);
    else
        result_.check.reason = "no image of this model's at this size is stored to compare with";
}

size_t ItemRun::memory() const {
    const auto pixels = [](Size size) { return static_cast<size_t>(size.width) * size.height; };
    const size_t floats = kSequenceFrames * 6 * pixels(upscaler_.render_size()) + 3 * pixels(upscaler_.output_size());
    return without_images(upscaler_.memory()) + floats * sizeof(float);
}

void ItemRun::take_turn(double start) {
    const double turn_start = now();
    add(upscaler_.turn(), start);
    seconds_ += now() - turn_start;
}

void ItemRun::add(const Turn& turn, double start) {
    frames_.insert(frames_.end(), turn.latencies.begin(), turn.latencies.end());
    latencies_.push_back(median(turn.latencies));
    rates_.push_back(turn.frames_per_second);
    device_seconds_.push_back(turn.device_seconds);
    if (stages_.empty())
        for (const StageProfile& stage : turn.stages)
            stages_.push_back({{stage.name, stage.kernel, {}, stage.operations, stage.bytes}, {}});
    for (size_t i = 0; i < stages_.size(); ++i) stages_[i].seconds.push_back(turn.stages[i].seconds);
    turns_.push_back({now() - start, latencies_.back(), clock_mhz()});
}

void ItemRun::check_image() {
    if (!expected_) return;
    const double check_start = now();
    Check& check = result_.check;
    const double difference = measure::difference(sketch(upscaler_.output_size(), upscaler_.output()), *expected_);
    check.largest_difference = std::max(difference, check.largest_difference.value_or(0));  // NaN stays
    check.result = difference <= *check.tolerance ? Check::Result::passed : Check::Result::failed;
    if (is_wrong())
        check.reason =
            fmt::format("the image is not the expected one: {:.2g} away, more than {:g}", difference, *check.tolerance);
    seconds_ += now() - check_start;
}

void ItemRun::finish() {
    if (is_wrong()) {
        result_.no_score = result_.check.reason;
        return;
    }
    Score score;
    score.latency = summarise(latencies_);
    score.p95 = quantile(frames_, 0.95);
    score.p99 = quantile(frames_, 0.99);
    score.frames = static_cast<int>(frames_.size());
    score.frames_per_second = summarise(rates_);
    score.device_seconds = summarise(device_seconds_);
    for (Stage& stage : stages_) {
        stage.result.seconds = summarise(stage.seconds);
        score.stages.push_back(std::move(stage.result));
    }
    score.turns = std::move(turns_);
    result_.score = std::move(score);
    result_.memory = upscaler_.memory();  // tuning may have changed it
}

}  // namespace clarus::measure
