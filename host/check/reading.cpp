#include "check/reading.h"

#include <set>
#include <stdexcept>

namespace clarus::check {

Vec2 Reading::displacement(Vec2 stored, Size render, double scale) const {
    Vec2 factor{1, 1};
    const auto [width, height] = render;
    if (unit == Unit::output_pixels) factor = {static_cast<float>(1 / scale), static_cast<float>(1 / scale)};
    if (unit == Unit::uv) factor = {static_cast<float>(width), static_cast<float>(height)};
    if (unit == Unit::half_uv) factor = {0.5f * static_cast<float>(width), 0.5f * static_cast<float>(height)};
    const Vec2 vector = motion_axes_swapped ? Vec2{stored.y, stored.x} : stored;
    const float direction = from_previous ? -1 : 1;
    return {direction * factor.x * vector.x, direction * (y_up ? -1 : 1) * factor.y * vector.y};
}

Vec2 Reading::oriented(Vec2 change) const {
    const Vec2 vector = jitter_axes_swapped ? Vec2{change.y, change.x} : change;
    return {jitter_x_flipped ? -vector.x : vector.x, jitter_y_flipped ? -vector.y : vector.y};
}

bool is_of_jitter(Field field) {
    return field == Field::jitter_x || field == Field::jitter_y || field == Field::jitter_axes ||
           field == Field::jitter_frame;
}

std::string name_of(Field field) {
    switch (field) {
        case Field::unit:
            return "motion.unit";
        case Field::direction:
            return "motion.direction";
        case Field::y:
            return "motion.y";
        case Field::motion_axes:
            return "motion axes";
        case Field::motion_frame:
            return "motion frame";
        case Field::jittered:
            return "motion.jittered";
        case Field::jitter_x:
            return "jitter x";
        case Field::jitter_y:
            return "jitter y";
        case Field::jitter_axes:
            return "jitter axes";
        case Field::jitter_frame:
            return "jitter frame";
    }
    throw std::logic_error("no such field");
}

int number_of(Field field, const Reading& reading) {
    switch (field) {
        case Field::unit:
            return static_cast<int>(reading.unit);
        case Field::direction:
            return reading.from_previous;
        case Field::y:
            return reading.y_up;
        case Field::motion_axes:
            return reading.motion_axes_swapped;
        case Field::motion_frame:
            return reading.motion_frame;
        case Field::jittered:
            return reading.jittered;
        case Field::jitter_x:
            return reading.jitter_x_flipped;
        case Field::jitter_y:
            return reading.jitter_y_flipped;
        case Field::jitter_axes:
            return reading.jitter_axes_swapped;
        case Field::jitter_frame:
            return reading.jitter_frame;
    }
    throw std::logic_error("no such field");
}

std::string value_of(Field field, const Reading& reading) {
    constexpr std::array units{"pixels", "output pixels", "uv", "half uv"};
    const int number = number_of(field, reading);
    switch (field) {
        case Field::unit:
            return units[static_cast<size_t>(number)];
        case Field::direction:
            return number ? "from_previous" : "to_previous";
        case Field::y:
            return number ? "up" : "down";
        case Field::jittered:
            return number ? "true" : "false";
        case Field::motion_axes:
        case Field::jitter_axes:
            return number ? "y, x" : "x, y";
        case Field::jitter_x:
        case Field::jitter_y:
            return number ? "opposite sign" : "as given";
        case Field::motion_frame:
        case Field::jitter_frame:
            return number == 0 ? "its own" : number < 0 ? "the frame before's" : "the next frame's";
    }
    throw std::logic_error("no such field");
}

Reading declared_reading(const io::Sequence& sequence) {
    Reading reading;
    reading.unit = sequence.motion.unit == io::MotionUnit::uv ? Unit::uv : Unit::pixels;
    reading.from_previous = sequence.motion.from_previous;
    reading.y_up = sequence.motion.y_up;
    reading.jittered = sequence.motion.jittered;
    return reading;
}

std::vector<Reading> all_readings() {
    std::vector<Reading> readings;
    for (const Unit unit : {Unit::pixels, Unit::output_pixels, Unit::uv, Unit::half_uv})
        for (const int frame : {0, -1, 1})
            for (int orientation = 0; orientation < 8; ++orientation)
                for (int jitter = 0; jitter < 9; ++jitter) {
                    const int flips = jitter - 1;  // −1: the jitter is in the vectors
                    readings.push_back({unit, (orientation & 1) != 0, (orientation & 2) != 0, (orientation & 4) != 0,
                                        frame, jitter == 0, jitter > 0 && (flips & 1) != 0,
                                        jitter > 0 && (flips & 2) != 0, jitter > 0 && (flips & 4) != 0, 0});
                }
    return readings;
}

std::vector<Reading> readings_of_other_jitters(const Reading& best) {
    std::vector<Reading> readings;
    // Where jitter is another frame's, the best so far may have made up for it by vectors of another frame.
    for (const int motion_frame : std::set{0, best.motion_frame})
        for (const int frame : {-1, 1})
            for (int flips = 0; flips < 8; ++flips) {
                Reading reading = best;
                reading.motion_frame = motion_frame;
                reading.jittered = false;
                reading.jitter_x_flipped = (flips & 1) != 0;
                reading.jitter_y_flipped = (flips & 2) != 0;
                reading.jitter_axes_swapped = (flips & 4) != 0;
                reading.jitter_frame = frame;
                readings.push_back(reading);
            }
    return readings;
}

}  // namespace clarus::check
