#pragma once

#include "render/random.h"
#include "render/renderer.h"
#include "render/worlds/film.h"

namespace clarus::render {

/// A camera before an action world's wall, still, turning, rolling past, held by hand or on an arc, at 15 to 120 frames
/// a second. One in six cuts to another place in every turn; half of those without FrameState::cut, as engines do that
/// forget it: its vectors then point to where things were in the other picture.
class ActionFilm {
  public:
    explicit ActionFilm(Random& random);

    FrameState operator()(int frame) const;

    /// Frames of a turn, and how many of them move where there is a stop.
    static constexpr int turn_frames = 36, moving_frames = 24;

  private:
    double clock(int frame, bool stops) const;
    const Shot& shot_at(int frame) const;

    double step_;                      // seconds a frame
    bool things_stop_, camera_stops_;  // at the end of every turn
    int braking_frames_;
    int cut_frame_ = 0;  // in every turn; 0: none
    bool cut_flagged_ = true;
    Shot first_, second_;
};

}  // namespace clarus::render
