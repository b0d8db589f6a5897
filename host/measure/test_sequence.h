#pragma once

#include <cstdint>
#include <vector>

#include "clarus/types.h"

namespace clarus::measure {

/// How many frames a test sequence has. The first is a cut; an NSRR model's four previous frames fit before the last.
constexpr int kSequenceFrames = 6;

struct TestFrame {
    Vec2 jitter;
    std::vector<float> color, depth, motion;  // 3, 1 and 2 channels, by the defaults of UpscalerOptions
};

/// One frame of a made-up sequence in which everything is moving: textured discs over a textured ground, seen through
/// Halton jitter, with the depth and motion that belong to them. The same values everywhere: made of whole numbers.
TestFrame test_frame(Size render, int index);

/// Well mixed bits of a number.
uint32_t hash(uint32_t value);

}  // namespace clarus::measure
