#include <doctest/doctest.h>
#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "clarus/error.h"
#include "clarus/jitter.h"
#include "render/worlds/world.h"
#include "render_harness.h"

// Whole worlds: what a training sequence is made of.

using namespace clarus;
using namespace clarus::render;
using namespace clarus::render_test;
using Imath::M44d;
using Imath::V2d;
using Imath::V3d;

namespace {

RenderSettings settings() {
    RenderSettings settings = small_settings();
    settings.reference_grid = 1;
    settings.far_plane = 20000;  // beyond everything: a depth of 1 is the sky
    return settings;
}

/// A few frames of a world, a few apart.
class Footage {
  public:
    static constexpr int count = 3;

    Footage(World world, int first_frame) : world_(std::move(world)), first_(first_frame) {
        for (int i = 0; i < count; ++i) pictures_.push_back(render(i));
    }
    Scene& scene() const { return *world_.scene; }
    FrameState state(int i) const { return world_.frame(number(i)); }
    Vec2 jitter(int i) const { return halton_jitter(number(i), 16); }
    /// As it was rendered at first, and now.
    const RenderedFrame& picture(int i) const { return pictures_[static_cast<size_t>(i)]; }
    RenderedFrame render(int i) const { return render_frame(scene(), state(i), jitter(i), settings()); }

  private:
    int number(int i) const { return first_ + 7 * i; }

    World world_;
    int first_;
    std::vector<RenderedFrame> pictures_;
};

void check_same(const RenderedFrame& a, const RenderedFrame& b) {
    for (const auto image :
         {&RenderedFrame::color, &RenderedFrame::depth, &RenderedFrame::motion, &RenderedFrame::reference})
        CHECK((a.*image).values == (b.*image).values);
}

/// Part and place, in the part's own space, that a ray from the camera meets first.
struct Met {
    const Scene::Part* part;
    V3d point;
    const Mesh* mesh;
    unsigned triangle;
    V3d weights;  // of the triangle's corners
};

/// Embree says which triangle it is; where on it, this file's own arithmetic. The scene's time is `state`'s.
std::optional<Met> meet(const Scene& scene, const FrameState& state, V2d pixel) {
    const auto [size, near_plane] = std::pair(settings().render_size, settings().near_plane);
    const double f = focal(state.camera, size);
    V3d direction;
    camera_to_world(state.camera)
        .multDirMatrix(V3d((pixel.x - size.width / 2.0) / f, (size.height / 2.0 - pixel.y) / f, -1), direction);
    const Imath::V3f origin(state.camera.position), along(direction);
    RTCRayHit query{};
    query.ray = {.org_x = origin.x,
                 .org_y = origin.y,
                 .org_z = origin.z,
                 .tnear = near_plane,
                 .dir_x = along.x,
                 .dir_y = along.y,
                 .dir_z = along.z,
                 .time = 0,
                 .tfar = std::numeric_limits<float>::infinity(),
                 .mask = ~0u,
                 .id = 0,
                 .flags = 0};
    query.hit.geomID = query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(scene.embree(), &context, &query);
    if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;

    const Scene::Part& part = scene.part(query.hit.instID[0]);
    const Mesh& mesh = part.model[query.hit.geomID];
    const auto [a, b, c] = mesh.triangles[query.hit.primID];
    const V3d corner(mesh.positions[a]);
    const V3d normal = (V3d(mesh.positions[b]) - corner) % (V3d(mesh.positions[c]) - corner);
    const M44d to_object = part.motion ? part.motion(state.seconds).inverse() : M44d();
    V3d object_direction;
    to_object.multDirMatrix(direction, object_direction);
    const V3d object_origin = state.camera.position * to_object;
    const double t = ((corner - object_origin) ^ normal) / (object_direction ^ normal);
    const V3d point = object_origin + object_direction * t;
    // Shares of the triangle's area.
    const auto area = [&](uint32_t i, uint32_t j) {
        return ((V3d(mesh.positions[i]) - point) % (V3d(mesh.positions[j]) - point)) ^ normal;
    };
    const V3d weights = V3d(area(b, c), area(c, a), area(a, b)) / normal.length2();
    return Met{&part, point, &mesh, query.hit.primID, weights};
}

V3d placed(const Met& met, double seconds) {
    if (met.part->deformation) {
        std::vector<Imath::V3f> positions(met.mesh->positions.size());
        met.part->deformation(seconds, positions);
        V3d place(0);
        for (int corner = 0; corner < 3; ++corner)
            place +=
                V3d(positions[met.mesh->triangles[met.triangle][static_cast<size_t>(corner)]]) * met.weights[corner];
        return place;
    }
    return met.part->motion ? met.point * met.part->motion(seconds) : met.point;
}

double view_distance(const CameraPose& pose, V3d world) { return -(world * camera_to_world(pose).inverse()).z; }

/// Numbers of pixels.
struct Census {
    int seen = 0, moving = 0, sky = 0, disputed = 0;
    double worst = 0;  // render pixels by which a vector misses
};

/// Every vector against where the point that is seen was, and every depth against where it is.
void add_frame(Census& census, const Footage& footage, int i) {
    const FrameState state = footage.state(i);
    const RenderedFrame& frame = footage.picture(i);
    const Vec2 jitter = footage.jitter(i);
    footage.scene().set_time(state.seconds, state.previous_seconds);
    const Size size = settings().render_size;
    for (int y = 0; y < size.height; ++y) {
        for (int x = 0; x < size.width; ++x) {
            const V2d pixel(x + 0.5 + jitter.x, y + 0.5 + jitter.y);
            const auto met = meet(footage.scene(), state, pixel);
            const bool is_sky = frame.depth.at(x, y, 0) == 1;
            if (is_sky && !met) ++census.sky;
            if (is_sky || !met) {
                census.disputed += is_sky == met.has_value();
                continue;
            }
            const V3d now = placed(*met, state.seconds), before = placed(*met, state.previous_seconds);
            const double distance = view_distance(state.camera, now);
            // A ray that passes an edge nearer than rounding may see this or that.
            if (std::abs(frame.depth.at(x, y, 0) * settings().far_plane / distance - 1) > 1e-3) {
                ++census.disputed;
                continue;
            }
            ++census.seen;
            if (view_distance(state.previous_camera, before) <= 0) continue;
            const V2d expected = project(state.previous_camera, before, size);
            const V2d landed = pixel + V2d(frame.motion.at(x, y, 0), frame.motion.at(x, y, 1));
            census.worst = std::max(census.worst, (landed - expected).length());
            census.moving += (project(state.previous_camera, now, size) - expected).length() > 0.05;
        }
    }
}

Census check_geometry(const Footage& footage) {
    Census census;
    for (int i = 0; i < Footage::count; ++i) add_frame(census, footage, i);
    CHECK(census.worst < 1e-3);
    const int pixels = Footage::count * settings().render_size.width * settings().render_size.height;
    CHECK(census.seen + census.sky + census.disputed == pixels);
    CHECK(census.disputed < 0.01 * pixels);
    MESSAGE(census.seen, " pixels of things, ", census.moving, " of them moving by themselves, ", census.sky,
            " of sky, ", census.disputed, " on edges; the worst vector misses by ", census.worst, " pixels");
    return census;
}

/// Nothing, and a message that says why, where the Debian package that has its models is missing.
std::optional<World> world_if_installed(const std::string& name) {
    try {
        return make_world(name, 0);
    } catch (const Error& error) {
        if (std::string(error.what()).find("apt-get install") == std::string::npos) throw;
        MESSAGE("skipped ", name, ": ", error.what());
        return std::nullopt;
    }
}

double mean(const io::Pixels& image) {
    double sum = 0;
    for (const float value : image.values) {
        REQUIRE(value >= 0);
        REQUIRE(value <= 1);
        sum += value;
    }
    return sum / static_cast<double>(image.values.size());
}

/// Neither black nor white nor flat; the reference shows the same things as the colour.
void check_light(const Footage& footage) {
    for (int i = 0; i < Footage::count; ++i) {
        const RenderedFrame& frame = footage.picture(i);
        const double tone = mean(frame.color);
        CHECK(tone > 0.03);
        CHECK(tone < 0.97);
        CHECK(mean(frame.reference) == doctest::Approx(tone).epsilon(0.1));
        const auto [darkest, brightest] = std::ranges::minmax(frame.reference.values);
        CHECK(brightest - darkest > 0.2);
    }
}

}  // namespace

TEST_CASE("A world that is made up: what moves by itself has exact vectors, too") {
    const Footage footage(make_world("procedural:4", 0), 2);
    CHECK(check_geometry(footage).moving > 50);
    check_light(footage);
}

TEST_CASE("Action: things that spin, roll, swing and walk have exact vectors, among fences and in front of patterns") {
    int moving = 0;
    for (const char* name : {"action:2", "action:7", "action:901"}) {
        CAPTURE(name);
        const Footage footage(make_world(name, 1), 3);
        moving += check_geometry(footage).moving;
        check_light(footage);
    }
    CHECK(moving > 500);
}

TEST_CASE("A race track: cars and wheels that turn, the same each time") {
    const std::string name = "torcs:a-speedway";
    std::optional<World> world = world_if_installed(name);
    if (!world) return;
    const Footage footage(*std::move(world), 2);
    const Census census = check_geometry(footage);
    CHECK(census.moving > 50);
    CHECK(census.sky > 50);
    check_light(footage);
    const Footage again(make_world(name, 0), 2);
    for (int i = 0; i < Footage::count; ++i) check_same(footage.picture(i), again.picture(i));
}

TEST_CASE("A flat with furniture: walls on all sides, and things that turn") {
    std::optional<World> world = world_if_installed("interior:1");
    if (!world) return;
    const Footage footage(*std::move(world), 142);
    const Census census = check_geometry(footage);
    CHECK(census.moving > 20);
    CHECK(census.sky < 0.1 * census.seen);
    check_light(footage);
    // A second flat would take as long again, most of it for its light; this one must not remember what it showed.
    check_same(footage.picture(0), footage.render(0));
}
