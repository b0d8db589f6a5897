#pragma once

#include <cstddef>
#include <string>

#include "check/warping.h"

// What is looked at while a run goes on: as much as the tests' truth table needs to be right.

namespace clarus::check {

inline constexpr size_t fewest_first_frames = 4, most_first_frames = 8;

/// What a film of so many frames, with motion, surely declares wrongly, field by field: "motion.direction is
/// to_previous, and from_previous fits better"; empty where that is nothing.
std::string surely_wrong(const Film& film);

}  // namespace clarus::check
