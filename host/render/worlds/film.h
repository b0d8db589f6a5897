#pragma once

#include <functional>
#include <vector>

#include "render/random.h"
#include "render/renderer.h"
#include "render/scene.h"

namespace clarus::render {

/// A camera's pose at a time of the moving objects, in seconds.
using Shot = std::function<CameraPose(double seconds)>;

/// Thinks up a shot that begins at a time.
using ShotIdea = std::function<Shot(Random& random, double seconds)>;

/// An endless film: shots with cuts between them, the first after 24 frames or more. In every cycle of 48 frames the
/// camera moves for 32 and stands still for 16, every other time together with all objects. Of what the ideas yield it
/// takes what keeps clear of everything and has something in view.
class Film {
  public:
    /// The scene must be built. The first shot follows the idea number % ideas.size().
    Film(Scene& scene, Random& random, int number, const std::vector<ShotIdea>& ideas);

    FrameState operator()(int frame) const;

  private:
    struct Clocks {
        double camera, objects;  // seconds; together at the start of every cycle
    };
    Clocks clocks(int frame) const;
    const Shot& shot_at(int frame) const;
    /// Of the frames from first to last, the share that is fit to be seen. Gives up early below `least`.
    double quality(Scene& scene, const Shot& shot, int first, int last, double least) const;

    struct Take {
        int first_frame;
        Shot shot;
    };
    std::vector<Take> takes_;
    int phase_, length_;
};

}  // namespace clarus::render
