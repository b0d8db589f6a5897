#include "render/worlds/track.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>
#include <optional>

#include "base/error.h"
#include "base/lower_case.h"
#include "render/worlds/probe.h"
#include "render/worlds/torcs_file.h"

namespace clarus::render {
namespace {

using Imath::V2d;
using Imath::V3d;

/// TORCS' ground plan: x and y, y to the left of x. In the model's coordinates x stays, z is −y.
struct Turtle {
    V2d place{0};
    double heading = 0;
    std::vector<V2d> trail{V2d(0)};  // a point every metre or so

    /// `curvature` is positive to the left.
    void go(double metres, double curvature) {
        const int steps = std::max(1, static_cast<int>(std::ceil(metres)));
        const double step = metres / steps;
        for (int i = 0; i < steps; ++i) {
            const double middle = heading + curvature * step / 2;
            const double half_turn = curvature * step / 2;
            const double chord = half_turn == 0 ? step : step * std::sin(half_turn) / half_turn;
            place += V2d(std::cos(middle), std::sin(middle)) * chord;
            heading += curvature * step;
            trail.push_back(place);
        }
    }

    /// A curve whose radius changes does so in steps of constant radius, and turns by `arc` in all.
    void turn(double radius, double end_radius, double arc, int steps, double side) {
        if (radius == end_radius) return go(radius * arc, side / radius);
        const double growth = (end_radius - radius) / std::max(1, steps - 1);
        double step = (radius + end_radius) / 2 * arc / steps, turned = 0;
        for (int i = 0; i < steps; ++i) turned += step / (radius + i * growth);
        step *= arc / turned;
        for (int i = 0; i < steps; ++i) go(step, side / (radius + i * growth));
    }
};

Turtle drive_segments(pugi::xml_node track, const std::filesystem::path& description) {
    const double steps_length = number(track, "profil steps length", 0);
    pugi::xml_node segments = section(track, "Track Segments");
    if (!segments) segments = section(track, "segments");
    Turtle turtle;
    for (const pugi::xml_node segment : segments.children("section")) {
        const std::string type = text(segment, "type");
        if (type == "str") {
            turtle.go(number(segment, "lg", 0), 0);
            continue;
        }
        const double radius = number(segment, "radius", 0), arc = number(segment, "arc", 0);
        const double end_radius = number(segment, "end radius", radius);
        if (radius <= 0 || end_radius <= 0 || arc <= 0) {
            fail(ErrorKind::file, "{}: the curve \"{}\" has no radius or no arc", description.string(),
                 segment.attribute("name").value());
        }
        const double step = number(segment, "profil steps length", steps_length);
        int steps = static_cast<int>(number(segment, "profil steps", 1));
        if (steps <= 1) steps = step > 0 ? static_cast<int>((radius + end_radius) / 2 * arc / step) + 1 : 1;
        turtle.turn(radius, end_radius, arc, steps, type == "lft" ? 1 : -1);
    }
    return turtle;
}

/// Points at equal distances of about a metre along a closed line whose last point is the first.
std::vector<V2d> evenly(const std::vector<V2d>& line) {
    std::vector<double> walked{0};
    for (size_t i = 1; i < line.size(); ++i) walked.push_back(walked.back() + (line[i] - line[i - 1]).length());
    const auto count = static_cast<size_t>(walked.back());
    std::vector<V2d> points;
    for (size_t piece = 1; points.size() < count;) {
        const double wanted = walked.back() * static_cast<double>(points.size()) / static_cast<double>(count);
        while (walked[piece] < wanted) ++piece;
        const double t = (wanted - walked[piece - 1]) / (walked[piece] - walked[piece - 1]);
        points.push_back(line[piece - 1] + (line[piece] - line[piece - 1]) * t);
    }
    return points;
}

/// The main track's surfaces are named tkmn and a number.
bool is_road(const Piece& piece) {
    const std::string name = lower_case(piece.name.substr(0, 5));
    return name.starts_with("tkmn") && name.size() == 5 && std::isdigit(static_cast<unsigned char>(name[4]));
}

size_t wrapped(long long index, size_t count) {
    const auto n = static_cast<long long>(count);
    return static_cast<size_t>((index % n + n) % n);
}

/// Unit, to the right of the way at a point of a closed line.
V2d right_of(const std::vector<V2d>& line, size_t i) {
    const V2d ahead = (line[(i + 1) % line.size()] - line[(i + line.size() - 1) % line.size()]).normalized();
    return {-ahead.y, ahead.x};
}

struct Box {
    V2d low{std::numeric_limits<double>::max()}, high{std::numeric_limits<double>::lowest()};
    void add(V2d p) {
        low = {std::min(low.x, p.x), std::min(low.y, p.y)};
        high = {std::max(high.x, p.x), std::max(high.y, p.y)};
    }
};

std::optional<double> height_at(const Scene& road, V2d at) { return ground_below(road, {at.x, 10000, at.y}); }

}  // namespace

std::string track_model(const std::filesystem::path& description) {
    const pugi::xml_document document = read_torcs_file(description);
    const std::string name = text(section(document.child("params"), "Graphic"), "3d description");
    if (name.empty()) fail(ErrorKind::file, "{} names no model of the track", description.string());
    return name;
}

Track::Track(const std::filesystem::path& description, const std::vector<Piece>& pieces) {
    const pugi::xml_document document = read_torcs_file(description);
    const pugi::xml_node track = section(document.child("params"), "Main Track");
    width_ = number(track, "width", 10);
    std::vector<V2d> trail = drive_segments(track, description).trail;
    const V2d gap = trail.front() - trail.back();
    if (trail.size() < 100 || gap.length() > 2) {
        fail(ErrorKind::file, "{}: the track does not close, {} m are missing", description.string(), gap.length());
    }
    for (size_t i = 0; i < trail.size(); ++i) {
        const V2d closed = trail[i] + gap * (static_cast<double>(i) / static_cast<double>(trail.size() - 1));
        trail[i] = {closed.x, -closed.y};
    }
    middle_ = evenly(trail);

    Mesh mesh;
    Box road_box, line_box;
    for (const Piece& piece : pieces) {
        if (is_road(piece)) mesh.append(piece.mesh);
    }
    for (const Imath::V3f& p : mesh.positions) road_box.add({p.x, p.z});
    const auto road = std::make_shared<Scene>();
    mesh.material = road->add_material({});
    road->add_static({mesh});
    road->build();
    road_ = road;

    // The plan's origin is elsewhere than the model's; one of the sides of the boxes around both fits.
    for (size_t i = 0; i < middle_.size(); ++i) {
        for (const double side : {-width_ / 2, width_ / 2}) line_box.add(middle_[i] + right_of(middle_, i) * side);
    }
    const V2d low = road_box.low - line_box.low, high = road_box.high - line_box.high;
    V2d best_shift(0);
    size_t most_on_road = 0;
    for (const V2d& shift : {low, high, V2d(low.x, high.y), V2d(high.x, low.y)}) {
        size_t on_road = 0;
        for (const V2d& point : middle_) on_road += height_at(*road_, point + shift).has_value();
        if (on_road > most_on_road) {
            most_on_road = on_road;
            best_shift = shift;
        }
    }
    if (most_on_road * 10 < middle_.size() * 9) {
        fail(ErrorKind::file, "{}: only {} of {} m of the track lie on its model", description.string(), most_on_road,
             middle_.size());
    }
    for (V2d& point : middle_) point += best_shift;
}

Way Track::lane(double offset) const {
    const size_t count = middle_.size();
    std::vector<V3d> points;
    double height = 0;
    for (size_t i = 0; i < count; ++i) {
        const V2d at = middle_[i] + right_of(middle_, i) * offset;
        height = height_at(*road_, at).value_or(height);
        points.emplace_back(at.x, height, at.y);
    }
    constexpr int smoothing = 3;
    const auto smooth = std::make_shared<std::vector<V3d>>(points);
    for (size_t i = 0; i < count; ++i) {
        double sum = 0;
        for (int j = -smoothing; j <= smoothing; ++j) sum += points[wrapped(static_cast<long long>(i) + j, count)].y;
        (*smooth)[i].y = sum / (2 * smoothing + 1);
    }
    return [smooth](double metres) {
        const double floor = std::floor(metres), t = metres - floor;
        const auto at = [&](int step) {
            return (*smooth)[wrapped(static_cast<long long>(floor) + step, smooth->size())];
        };
        // Catmull and Rom's curve through the points.
        const V3d p0 = at(-1), p1 = at(0), p2 = at(1), p3 = at(2);
        return p1 + ((p2 - p0) + ((p0 * 2 - p1 * 5 + p2 * 4 - p3) + (p1 * 3 - p0 - p2 * 3 + p3) * t) * t) * (t / 2);
    };
}

}  // namespace clarus::render
