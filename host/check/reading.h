#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "io/sequence.h"

namespace clarus::check {

enum class Unit { pixels, output_pixels, uv, half_uv };  // the last: of −1…1, as clip space has it

/// One way to read what a sequence's motion images and jitters hold: where pixel c of a frame was in the image before
/// is, in index coordinates, c + displacement(stored vector) + shift(jitters).
struct Reading {
    Unit unit = Unit::pixels;
    bool from_previous = false, y_up = false;
    bool motion_axes_swapped = false;
    int motion_frame = 0;   // −1, 1: motion images are those of the frame before, or after
    bool jittered = false;  // the camera's jitter is in the vectors: nothing is to be added
    bool jitter_x_flipped = false, jitter_y_flipped = false, jitter_axes_swapped = false;  // against the JSON's
    int jitter_frame = 0;                                                                  // as motion_frame

    friend bool operator==(const Reading&, const Reading&) = default;

    Vec2 displacement(Vec2 stored, Size render, double scale) const;
    /// `change`: of the jitters as they are in the JSON, from the frame before to this one.
    Vec2 oriented(Vec2 change) const;
    Vec2 shift(Vec2 change) const { return jittered ? Vec2{} : oriented(change); }
};

/// What of a reading can be wrong on its own.
enum class Field {
    unit,
    direction,
    y,
    motion_axes,
    motion_frame,
    jittered,
    jitter_x,
    jitter_y,
    jitter_axes,
    jitter_frame
};
inline constexpr std::array all_fields{Field::unit,         Field::direction,   Field::y,        Field::motion_axes,
                                       Field::motion_frame, Field::jittered,    Field::jitter_x, Field::jitter_y,
                                       Field::jitter_axes,  Field::jitter_frame};

bool is_of_jitter(Field field);  // of its orientation and frame
/// "motion.direction", "jitter x"
std::string name_of(Field field);
/// As the JSON or a table says it: "from_previous".
std::string value_of(Field field, const Reading& reading);
/// A number that differs where the field's values do.
int number_of(Field field, const Reading& reading);

/// What a sequence's JSON says.
Reading declared_reading(const io::Sequence& sequence);

/// Every motion with every jitter of the JSON's frame, and without; of jitters of other frames none.
std::vector<Reading> all_readings();
/// `best` with jitters of the frames before and after.
std::vector<Reading> readings_of_other_jitters(const Reading& best);

}  // namespace clarus::check
