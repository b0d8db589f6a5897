#include "check/warping.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <iterator>
#include <limits>

#include "check/parallel.h"

namespace clarus::check {
namespace {

constexpr float least_gradient = 0.02f;     // of luma a pixel: below, nothing is seen to move
constexpr size_t fewest_pixels = 64;        // of a pair that counts
constexpr float largest_difference = 0.2f;  // what is farther off is wrong, however far
constexpr float unexplained = 0.08f;        // by every reading: uncovered
constexpr float noise = 0.001f;             // a quarter of an 8-bit level: no reading is better than that

struct Place {
    int x, y;
};

/// Evenly spread, `most` of them where there are more.
std::vector<Place> thinned(const std::vector<Place>& places, size_t most) {
    if (places.size() <= most) return places;
    std::vector<Place> taken;
    for (size_t i = 0; i < most; ++i) taken.push_back(places[i * places.size() / most]);
    return taken;
}

/// Places with a gradient. Where few things move, most places are still taken on those.
std::vector<Place> places_to_compare(const Plane& luma, const io::Pixels& motion, size_t most) {
    const bool can_move = motion.size == luma.size && !motion.values.empty();
    const float moving = can_move ? length_of_movers(motion) : 0;
    std::vector<Place> movers, others;
    for (int y = 1; y + 1 < luma.size.height; ++y)
        for (int x = 1; x + 1 < luma.size.width; ++x) {
            if (std::hypot(luma.at(x + 1, y) - luma.at(x - 1, y), luma.at(x, y + 1) - luma.at(x, y - 1)) <
                2 * least_gradient)
                continue;
            const bool moves = moving > 0 && std::hypot(motion.at(x, y, 0), motion.at(x, y, 1)) >= moving;
            (moves ? movers : others).push_back({x, y});
        }
    const size_t most_movers = std::max(2 * most / 3, most - std::min(most, others.size()));
    std::vector<Place> places = thinned(movers, most_movers);
    std::ranges::copy(thinned(others, most - std::min(most, places.size())), std::back_inserter(places));
    return places;
}

/// Differences at all places, of one reading; false where a frame lacks what it needs.
bool differences(const Film& film, Pair pair, const Reading& reading, const std::vector<Place>& places, float* out) {
    const std::optional<Vec2> change = film.jitter_change(pair.before, pair.frame, reading.jitter_frame);
    const bool moves = film.has_motion();
    const io::Pixels* motion = film.motion_of(pair.frame, reading);
    if (!change || (moves && !motion)) return false;
    const Plane &present = film.luma[pair.frame], &before = film.luma[pair.before];
    const Vec2 shift = reading.shift(*change);
    for (const Place& place : places) {
        Vec2 move;
        if (moves)
            move = reading.displacement({motion->at(place.x, place.y, 0), motion->at(place.x, place.y, 1)},
                                        present.size, film.sequence.scale);
        const float x = static_cast<float>(place.x) + move.x + shift.x;
        const float y = static_cast<float>(place.y) + move.y + shift.y;
        const float now = present.at(place.x, place.y);
        const float then = before.contains(x, y) ? sample(before, x, y) : before.at(place.x, place.y);
        *out++ = std::min(std::abs(now - then), largest_difference);
    }
    return true;
}

/// Of each reading the mean difference at places that some reading explains.
std::vector<float> mean_errors(const Film& film, Pair pair, const std::vector<Reading>& readings,
                               const std::vector<Place>& places, size_t fewest) {
    std::vector<float> all(readings.size() * places.size());
    std::vector<char> measured(readings.size());
    std::vector<float> least(places.size(), largest_difference);
    for (size_t r = 0; r < readings.size(); ++r) {
        float* row = all.data() + r * places.size();
        measured[r] = differences(film, pair, readings[r], places, row);
        if (measured[r])
            for (size_t i = 0; i < places.size(); ++i) least[i] = std::min(least[i], row[i]);
    }
    std::vector<float> errors(readings.size(), std::numeric_limits<float>::quiet_NaN());
    for (size_t r = 0; r < readings.size(); ++r) {
        if (!measured[r]) continue;
        double sum = 0;
        size_t count = 0;
        for (size_t i = 0; i < places.size(); ++i)
            if (least[i] < unexplained) sum += all[r * places.size() + i], ++count;
        if (count >= fewest) errors[r] = noise + static_cast<float>(sum / static_cast<double>(count));
    }
    return errors;
}

/// A column of WarpErrors::errors; empty where the frame has too little structure.
std::vector<float> errors_of(const Film& film, Pair pair, const std::vector<Reading>& readings, size_t pixels) {
    const std::vector<Place> places = places_to_compare(film.luma[pair.frame], film.motion[pair.frame], pixels);
    if (places.size() < fewest_pixels || film.luma[pair.frame].size != film.luma[pair.before].size) return {};
    return mean_errors(film, pair, readings, places, fewest_pixels);
}

}  // namespace

float length_of_movers(const io::Pixels& motion) {
    std::vector<float> lengths;
    for (size_t i = 0; i + 1 < motion.values.size(); i += 2) {
        const float length = std::hypot(motion.values[i], motion.values[i + 1]);
        if (std::isfinite(length)) lengths.push_back(length);
    }
    if (lengths.empty()) return 0;
    const auto high = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() - 1 - lengths.size() / 100);
    std::nth_element(lengths.begin(), high, lengths.end());
    return *high / 4;
}

void ColorTraits::add(const io::Pixels& color) {
    for (const float value : color.values) {
        ++values;
        if (value > 1.001f) ++above_one;
        const float level = std::round(std::clamp(value, 0.0f, 1.0f) * 255);
        if (!(std::abs(value * 255 - level) < 1e-3f)) is_eight_bit = false;
        seen[static_cast<size_t>(level >= 0 ? level : 0)] = true;
    }
}

bool ColorTraits::has_variety() const { return std::ranges::count(seen, true) >= 16; }

void Film::add(io::FramePixels frame) {
    color.add(frame.color);
    luma.push_back(smooth_luma(frame.color));
    depth.push_back(std::move(frame.depth));
    motion.push_back(std::move(frame.motion));
}

bool Film::has_motion() const {
    return std::ranges::any_of(motion, [](const io::Pixels& image) { return !image.values.empty(); });
}

bool Film::has_depth() const {
    return !depth.empty() && std::ranges::all_of(depth, [](const io::Pixels& image) { return !image.values.empty(); });
}

std::optional<Vec2> Film::jitter_change(size_t before, size_t frame, int offset) const {
    const auto count = static_cast<long>(sequence.frames.size());
    const long from = static_cast<long>(before) + offset, to = static_cast<long>(frame) + offset;
    if (from < 0 || to < 0 || from >= count || to >= count) return std::nullopt;
    const Vec2 a = sequence.frames[static_cast<size_t>(from)].jitter,
               b = sequence.frames[static_cast<size_t>(to)].jitter;
    return Vec2{b.x - a.x, b.y - a.y};
}

const io::Pixels* Film::motion_of(size_t frame, const Reading& reading) const {
    const long index = static_cast<long>(frame) + reading.motion_frame;
    if (index < 0 || index >= static_cast<long>(motion.size())) return nullptr;
    const io::Pixels& image = motion[static_cast<size_t>(index)];
    return image.values.empty() || image.size != luma[frame].size ? nullptr : &image;
}

std::vector<Pair> successive_pairs(const Film& film) {
    std::vector<Pair> pairs;
    for (size_t i = 1; i < film.sequence.frames.size(); ++i)
        if (!film.sequence.frames[i].reset) pairs.push_back({i - 1, i});
    return pairs;
}

size_t WarpErrors::index_of(const Reading& reading) const {
    return static_cast<size_t>(std::ranges::find(readings, reading) - readings.begin());
}

WarpErrors measure_warps(const Film& film, const std::vector<Pair>& pairs, std::vector<Reading> readings, size_t pixels,
                         const std::function<void(double)>& done) {
    std::vector<std::vector<float>> columns(pairs.size());
    std::atomic<size_t> finished = 0;
    for_each_index(pairs.size(), [&](size_t i) {
        columns[i] = errors_of(film, pairs[i], readings, pixels);
        if (done) done(static_cast<double>(++finished) / static_cast<double>(pairs.size()));
    });
    WarpErrors result;
    result.readings = std::move(readings);
    result.errors.resize(result.readings.size());
    for (size_t i = 0; i < pairs.size(); ++i) {
        if (columns[i].empty()) continue;
        result.pairs.push_back(pairs[i]);
        for (size_t r = 0; r < result.readings.size(); ++r) result.errors[r].push_back(columns[i][r]);
    }
    return result;
}

std::array<std::vector<float>, 3> measure_motion_frames(const Film& film, const std::vector<Pair>& pairs,
                                                        Reading reading, size_t pixels) {
    constexpr float least_distance = 0.25f;  // pixels
    std::vector<Reading> readings(3, reading);
    for (size_t i = 0; i < 3; ++i) readings[i].motion_frame = i == 0 ? 0 : i == 1 ? -1 : 1;
    std::array<std::vector<float>, 3> result;
    for (auto& answer : result) answer.assign(pairs.size(), std::numeric_limits<float>::quiet_NaN());
    for_each_index(pairs.size(), [&](size_t i) {
        const auto [before, frame] = pairs[i];
        const Plane& luma = film.luma[frame];
        const io::Pixels* own = film.motion_of(frame, readings[0]);
        if (!own || luma.size != film.luma[before].size) return;
        const auto vector = [&](const io::Pixels& image, const Place& place) {
            return reading.displacement({image.at(place.x, place.y, 0), image.at(place.x, place.y, 1)}, luma.size,
                                        film.sequence.scale);
        };
        std::vector<Place> places;
        for (const Place& place : places_to_compare(luma, *own, std::numeric_limits<int>::max())) {
            bool differs = false;
            for (const Reading& other : {readings[1], readings[2]})
                if (const io::Pixels* image = film.motion_of(frame, other)) {
                    const Vec2 a = vector(*own, place), b = vector(*image, place);
                    differs = differs || std::hypot(a.x - b.x, a.y - b.y) >= least_distance;
                }
            if (differs) places.push_back(place);
        }
        constexpr size_t fewest = 16;  // at such places little is enough
        const std::vector<float> errors = mean_errors(film, pairs[i], readings, thinned(places, pixels), fewest);
        for (size_t answer = 0; answer < 3; ++answer) result[answer][i] = errors[answer];
    });
    return result;
}

}  // namespace clarus::check
