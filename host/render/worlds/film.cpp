#include "render/worlds/film.h"

#include <algorithm>
#include <cmath>

#include "render/worlds/beat.h"
#include "render/worlds/probe.h"

namespace clarus::render {
namespace {

constexpr int takes = 5;
constexpr size_t attempts = 30, attempts_an_idea = 10;
constexpr int shortest_take = 24;
constexpr double least_clearance = 0.3;  // metres
constexpr int most_things = 5;           // different ones that a picture must have

}  // namespace

Film::Film(Scene& scene, Random& random, int number, const std::vector<ShotIdea>& ideas) {
    phase_ = random.below(21);
    int frame = 0;
    for (int take = 0; take < takes; ++take) {
        takes_.push_back({frame, {}});
        frame += shortest_take + random.below(take == 0 ? 150 : 200);
    }
    // Whole pairs of cycles, so that the beat goes on when the film starts again.
    length_ = (frame + 2 * cycle_frames - 1) / (2 * cycle_frames) * 2 * cycle_frames;
    for (size_t take = 0; take < takes_.size(); ++take) {
        const int first = takes_[take].first_frame;
        const int last = take + 1 < takes_.size() ? takes_[take + 1].first_frame : length_;
        const size_t first_idea = take == 0 ? static_cast<size_t>(number) : random.bits();
        double best = -1;
        for (size_t attempt = 0; attempt < attempts && best < 1; ++attempt) {
            const ShotIdea& idea = ideas[(first_idea + attempt / attempts_an_idea) % ideas.size()];
            const Shot shot = idea(random, clocks(first).camera);
            const double found = quality(scene, shot, first, last, best);
            if (found > best) {
                best = found;
                takes_[take].shot = shot;
            }
        }
    }
    scene.set_time(0, 0);
}

double Film::quality(Scene& scene, const Shot& shot, int first, int last, double least) const {
    constexpr int step = 4;
    // Scenes of a few meshes cannot show many.
    const int least_things = std::min(most_things, (static_cast<int>(scene.part(0).model.size()) + 2) / 2);
    int good = 0, bad = 0;
    const int checks = (last - first + step - 1) / step;
    for (int frame = first; frame < last; frame += step) {
        const Clocks now = clocks(frame);
        scene.set_time(now.objects, now.objects);
        const CameraPose pose = shot(now.camera);
        // Where nothing is below, the camera is under the ground.
        const bool clear = clearance(scene, pose.position, 2 * least_clearance) > least_clearance &&
                           ground_below(scene, pose.position);
        const View view = clear ? look(scene, pose) : View{};
        const bool fit = clear && view.close < 0.12 && view.empty < 0.6 && view.things >= least_things;
        (fit ? good : bad) += 1;
        if (checks - bad <= least * checks) break;
    }
    return static_cast<double>(good) / checks;
}

Film::Clocks Film::clocks(int frame) const {
    const int shifted = frame + phase_;
    const int cycle = static_cast<int>(std::floor(static_cast<double>(shifted) / cycle_frames));
    const int in_cycle = shifted - cycle * cycle_frames;
    const bool objects_stop = cycle % 2 == 0;
    const int stopped_before = (cycle + 1) / 2 * still_frames;
    const double cycle_start = (cycle * cycle_frames - stopped_before) * time_step;
    const int object_frames = objects_stop ? std::min(in_cycle, moving_frames) : in_cycle;
    const double cycle_length = (objects_stop ? moving_frames : cycle_frames) * time_step;
    const double done = eased_seconds(std::min(in_cycle, moving_frames)) / eased_seconds(moving_frames);
    return {cycle_start + cycle_length * done, cycle_start + object_frames * time_step};
}

const Shot& Film::shot_at(int frame) const {
    const auto after = std::ranges::upper_bound(takes_, frame, {}, &Take::first_frame);
    return std::prev(after)->shot;
}

FrameState Film::operator()(int frame) const {
    const int turn = frame % length_;
    const auto starts_take = [&](const Take& take) { return take.first_frame == turn; };
    const bool cut = frame > 0 && std::ranges::any_of(takes_, starts_take);
    const Clocks now = clocks(turn), before = clocks(turn - 1);
    const Shot& shot = shot_at(turn);
    const CameraPose pose = shot(now.camera);
    return {pose, cut ? pose : shot(before.camera), now.objects, before.objects, cut};
}

}  // namespace clarus::render
