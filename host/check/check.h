#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "check/depth.h"
#include "check/warping.h"

// Whether a sequence's files hold what its JSON says. Method, units and sources: docs/checking.md.

namespace clarus::check {

/// What was measured of a film. It depends on images, jitters, planes and cameras, and on nothing that the JSON
/// declares of them.
struct Evidence {
    WarpErrors warps;
    Reading best;  // of `warps`
    DepthEvidence depth;
    Answers<3> motion_frames, depth_edges;
    int depth_frame = 0;  // by `depth_edges`, for sure: depth images are those of so many frames later
    ColorTraits color;
    /// Frames whose frame before, by the images, is another than the one before it in the sequence; with `before` that.
    std::vector<Pair> misplaced;
    /// Where that gives a chain of all frames: in which order. What else is measured is measured in it.
    std::vector<size_t> order;
    size_t frames = 0, ordered = 0;  // all of them; those whose frame before could be looked for
    bool has_motion = false, has_depth = false, has_jitter = false;
    /// A pair of `warps` each: the median displacement by `best`, and the change of the JSON's jitter.
    std::vector<Vec2> motion, jitter;
};

/// `pixels`: as measure_warps. `done` is told the share of the work that is done.
Evidence measure(const Film& film, size_t pixels, const std::function<void(double)>& done = {});

enum class Verdict { right, cannot_tell, wrong };  // the first and the last for sure

/// "right", "cannot tell" or "wrong".
const char* word(Verdict verdict);

/// A line of the table.
struct Finding {
    std::string field;           // "motion.direction", "jitter x"
    std::string declared, best;  // `best` is what fits best, even where nothing can be told
    double gain = 0;             // dB: of what fits best over what is declared; where that is the same, over the rest
    Verdict verdict = Verdict::cannot_tell;
    size_t agree = 0, count = 0;  // frames or pairs of frames that say the same, of how many
    /// The others' names where these are the exceptions: for sure, or in the order of frames a single one. Of pairs,
    /// the second's.
    std::vector<std::string> against;
    std::string note;
};

/// "5 of 7, not 0003 0004": at most four names. "–" where nothing could be compared.
std::string frames_of(const Finding& finding);

/// What the JSON would have to say.
struct Correction {
    Reading reading;
    std::optional<bool> depth_projective, depth_reversed;
    std::optional<ColorSpace> color_space;
    bool no_jitter = false;
    int depth_frame = 0;                 // as Reading::motion_frame
    std::vector<size_t> order;           // of the frames; empty where it stays or is not known
    std::vector<std::string> unsayable;  // what is wrong and cannot be said in a JSON
};

struct Judgement {
    std::vector<Finding> findings;
    Correction correction;  // of what is surely wrong

    bool is_wrong() const;
    const Finding* find(const std::string& field) const;
};

/// Holds what was measured against what the sequence declares.
Judgement judge(const Evidence& evidence, const io::Sequence& declared);

}  // namespace clarus::check
