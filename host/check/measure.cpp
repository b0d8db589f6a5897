#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <utility>

#include "check/check.h"
#include "check/statistics.h"

namespace clarus::check {
namespace {

constexpr size_t fewest_places = 300;
constexpr size_t order_reach = 3;   // frames: how far away the frame before is looked for
constexpr double order_gain = 1.5;  // dB, by which another frame must fit better

/// The reading whose errors are least: by the mean over pairs of its decibels against the first reading's.
size_t index_of_best(const WarpErrors& warps) {
    size_t best = 0;
    double best_gain = 0;
    for (size_t r = 1; r < warps.readings.size(); ++r) {
        const Advantage over = advantage(warps.errors[r], warps.errors[0]);
        if (over.count > 0 && over.gain > best_gain) best = r, best_gain = over.gain;
    }
    return best;
}

/// Whether a sequence's JSON can say it.
bool is_sayable(const Reading& reading) {
    const bool has_own_jitter = !reading.jitter_x_flipped && !reading.jitter_y_flipped && !reading.jitter_axes_swapped;
    return (reading.unit == Unit::pixels || reading.unit == Unit::uv) && !reading.motion_axes_swapped &&
           reading.motion_frame == 0 && has_own_jitter;
}

/// Of many readings those that fit best, on the whole and of each value of each field, and all that a JSON can say.
std::vector<Reading> shortlist(const WarpErrors& warps) {
    constexpr size_t on_the_whole = 48, of_each_value = 3;
    std::vector<std::pair<double, size_t>> ranking;
    for (size_t r = 0; r < warps.readings.size(); ++r) {
        const Advantage over = advantage(warps.errors[r], warps.errors[0]);
        if (over.count > 0) ranking.emplace_back(-over.gain, r);
    }
    std::ranges::sort(ranking);
    std::map<std::pair<Field, int>, size_t> taken;
    std::vector<Reading> result;
    for (const auto& [minus_gain, r] : ranking) {
        const Reading& reading = warps.readings[r];
        bool is_wanted = result.size() < on_the_whole || is_sayable(reading);
        for (const Field field : all_fields) {
            if (is_of_jitter(field) && reading.jittered) continue;
            if (taken[{field, number_of(field, reading)}]++ < of_each_value) is_wanted = true;
        }
        if (is_wanted) result.push_back(reading);
    }
    return result;
}

/// Every frame with those around it as its frame before.
std::vector<Pair> pairs_around(const Film& film) {
    std::vector<Pair> pairs;
    const size_t count = film.sequence.frames.size();
    for (size_t frame = 1; frame < count; ++frame) {
        if (film.sequence.frames[frame].reset) continue;
        for (size_t before = frame - std::min(frame, order_reach); before < std::min(count, frame + order_reach + 1);
             ++before) {
            const auto [low, high] = std::minmax(before, frame);
            bool is_cut = false;
            for (size_t i = low + 1; i <= high; ++i) is_cut = is_cut || film.sequence.frames[i].reset;
            if (before != frame && !is_cut) pairs.push_back({before, frame});
        }
    }
    return pairs;
}

void look_for_misplaced(const Film& film, size_t pixels, Evidence& evidence) {
    const WarpErrors errors = measure_warps(film, pairs_around(film), {evidence.best}, pixels);
    for (size_t frame = 1; frame < film.sequence.frames.size(); ++frame) {
        float declared = NAN, best = NAN;
        size_t before = frame;
        for (size_t i = 0; i < errors.pairs.size(); ++i) {
            const float error = errors.errors[0][i];
            if (errors.pairs[i].frame != frame || std::isnan(error)) continue;
            if (errors.pairs[i].before + 1 == frame) declared = error;
            if (!(error >= best)) best = error, before = errors.pairs[i].before;
        }
        if (std::isnan(declared)) continue;
        ++evidence.ordered;
        if (before + 1 != frame && 20 * std::log10(declared / best) >= order_gain)
            evidence.misplaced.push_back({before, frame});
    }
}

/// The chain of frames, each after the one before it; empty where they make none.
std::vector<size_t> chain_of(size_t frames, const std::vector<Pair>& misplaced) {
    std::vector<size_t> before(frames), after(frames, frames);
    for (size_t i = 1; i < frames; ++i) before[i] = i - 1;
    for (const Pair& pair : misplaced) before[pair.frame] = pair.before;
    for (size_t i = 1; i < frames; ++i) {
        if (after[before[i]] != frames) return {};
        after[before[i]] = i;
    }
    std::vector<size_t> chain;
    for (size_t i = 0; i < frames && chain.size() < frames; i = after[i]) chain.push_back(i);
    return chain.size() == frames ? chain : std::vector<size_t>{};
}

Film reordered(const Film& film, const std::vector<size_t>& order) {
    Film result = film;
    for (size_t i = 0; i < order.size(); ++i) {
        result.sequence.frames[i] = film.sequence.frames[order[i]];
        result.luma[i] = film.luma[order[i]];
        result.depth[i] = film.depth[order[i]];
        result.motion[i] = film.motion[order[i]];
    }
    return result;
}

Vec2 median_displacement(const Film& film, size_t frame, const Reading& reading) {
    const io::Pixels* motion = film.motion_of(frame, reading);
    if (!motion) return {NAN, NAN};
    std::vector<float> x, y;
    for (size_t i = 0; i + 1 < motion->values.size(); i += 2) {
        const Vec2 move =
            reading.displacement({motion->values[i], motion->values[i + 1]}, motion->size, film.sequence.scale);
        if (std::isfinite(move.x) && std::isfinite(move.y)) x.push_back(move.x), y.push_back(move.y);
    }
    if (x.empty()) return {NAN, NAN};
    const auto middle = [](std::vector<float>& values) {
        const auto at = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
        std::nth_element(values.begin(), at, values.end());
        return *at;
    };
    return {middle(x), middle(y)};
}

/// Which frame's depth images are, for sure; else 0.
int sure_frame(const Answers<3>& edges) {
    for (const auto& [answer, frame] : {std::pair(1, -1), std::pair(2, 1)})
        if (advantage(edges[static_cast<size_t>(answer)], edges[0]).is_sure(least_of_edges)) return frame;
    return 0;
}

/// All but the first reading's errors, at many places, of a film in the right order.
void measure_closely(const Film& film, const std::vector<Pair>& pairs, size_t pixels, Evidence& evidence,
                     const std::function<void(double)>& done) {
    std::vector<Reading> readings = shortlist(evidence.warps);
    std::ranges::copy(readings_of_other_jitters(evidence.best), std::back_inserter(readings));
    evidence.warps = measure_warps(film, pairs, readings, pixels, done);
    if (evidence.warps.pairs.empty()) return;
    evidence.best = evidence.warps.readings[index_of_best(evidence.warps)];
    if (evidence.has_motion)
        evidence.motion_frames = measure_motion_frames(film, evidence.warps.pairs, evidence.best, pixels);
    evidence.depth_edges = measure_depth_edges(film);
    evidence.depth_frame = sure_frame(evidence.depth_edges);
    evidence.depth = measure_depth(film, evidence.warps.pairs, evidence.best, evidence.depth_frame);
    for (const Pair& pair : evidence.warps.pairs) {
        evidence.motion.push_back(median_displacement(film, pair.frame, evidence.best));
        evidence.jitter.push_back(*film.jitter_change(pair.before, pair.frame, 0));
    }
}

}  // namespace

Evidence measure(const Film& film, size_t pixels, const std::function<void(double)>& done) {
    Evidence evidence;
    const auto told = [&](double from, double to) {
        return [&done, from, to](double fraction) {
            if (done) done(from + (to - from) * fraction);
        };
    };
    evidence.frames = film.sequence.frames.size();
    evidence.has_motion = film.has_motion();
    evidence.has_depth = film.has_depth();
    evidence.color = film.color;
    std::vector<Pair> pairs = successive_pairs(film);
    for (const Pair& pair : pairs) {
        const std::optional<Vec2> change = film.jitter_change(pair.before, pair.frame, 0);
        evidence.has_jitter = evidence.has_jitter || change->x != 0 || change->y != 0;
    }
    evidence.warps = measure_warps(film, pairs, all_readings(), std::max(pixels / 3, fewest_places), told(0, 0.6));
    if (evidence.warps.pairs.empty()) return evidence;
    evidence.best = evidence.warps.readings[index_of_best(evidence.warps)];

    // With what fits on the whole, frames that are out of order stand out. In the right order, and at more places, what
    // may be the best is measured again.
    if (evidence.has_motion) look_for_misplaced(film, pixels, evidence);
    if (evidence.misplaced.size() > 1) evidence.order = chain_of(evidence.frames, evidence.misplaced);
    if (!evidence.order.empty()) {
        const Film right = reordered(film, evidence.order);
        measure_closely(right, successive_pairs(right), pixels, evidence, told(0.6, 0.9));
        return evidence;
    }
    std::erase_if(pairs, [&](const Pair& pair) {
        return std::ranges::any_of(evidence.misplaced, [&](const Pair& other) { return other.frame == pair.frame; });
    });
    measure_closely(film, pairs, pixels, evidence, told(0.6, 0.9));
    return evidence;
}

}  // namespace clarus::check
