#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <vector>

#include "check/plane.h"
#include "check/reading.h"
#include "io/frames.h"
#include "io/sequence.h"

namespace clarus::check {

/// What colour values tell of their space.
struct ColorTraits {
    size_t values = 0, above_one = 0;
    bool is_eight_bit = true;      // all are multiples of 1/255
    std::array<bool, 256> seen{};  // of these multiples

    void add(const io::Pixels& color);
    /// Enough to tell something.
    bool has_variety() const;
};

/// A run of frames that lie one after the other. A frame that resets follows none.
struct Film {
    io::Sequence sequence;    // its frames are those below
    std::vector<Plane> luma;  // smooth
    ColorTraits color;
    std::vector<io::Pixels> depth, motion;  // as stored; empty where a frame has none

    void add(io::FramePixels frame);  // the next one of sequence.frames
    /// All frames of `sequence`, with depth and motion. `done` is told how many are there. Errors: file.
    static Film read(io::Sequence sequence, const std::function<void(size_t)>& done = {});

    bool has_motion() const;
    bool has_depth() const;
    /// Of jitters, from frame `before` to `frame`, those of the frames `offset` later; none where there are none.
    std::optional<Vec2> jitter_change(size_t before, size_t frame, int offset) const;
    /// Stored vectors that a reading takes for frame `frame`; null where it has none.
    const io::Pixels* motion_of(size_t frame, const Reading& reading) const;
};

/// A frame and the one that is taken to be before it.
struct Pair {
    size_t before, frame;
};

std::vector<Pair> successive_pairs(const Film& film);

/// How far previous frames, warped by each reading, are from the present ones.
struct WarpErrors {
    std::vector<Pair> pairs;  // those with enough structure to tell
    std::vector<Reading> readings;
    std::vector<std::vector<float>> errors;  // [reading][pair]: mean difference of luma; NaN where a frame lacks

    size_t index_of(const Reading& reading) const;  // readings.size() where it is not there
};

/// A quarter of the length that one in a hundred vectors exceeds, in stored units.
float length_of_movers(const io::Pixels& motion);

/// `pixels`: how many, evenly spread over those where the present image has a gradient, are compared for a pair. A
/// pixel that no reading explains is uncovered, or changed its light, and does not count. A pixel that a reading takes
/// from outside the image counts as if nothing moved. `done`: called with a fraction of the work, on any thread.
WarpErrors measure_warps(const Film& film, const std::vector<Pair>& pairs, std::vector<Reading> readings, size_t pixels,
                         const std::function<void(double)>& done = {});

/// As measure_warps, of one reading with the motion images of the frame itself [0], of the one before [1], of the next
/// [2]; only at places where these differ by a quarter of a pixel at least. A pair each.
std::array<std::vector<float>, 3> measure_motion_frames(const Film& film, const std::vector<Pair>& pairs,
                                                        Reading reading, size_t pixels);

}  // namespace clarus::check
