#include "render/worlds/world.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <set>
#include <string>

#include "clarus/error.h"
#include "render/worlds/action_film.h"
#include "render/worlds/action_kinds.h"
#include "render/worlds/demo_scene.h"
#include "render/worlds/film.h"
#include "render/worlds/probe.h"
#include "render/worlds/shots.h"
#include "render/worlds/torcs.h"
#include "render_harness.h"
#include "temporary_folder.h"

using namespace clarus;
using namespace clarus::render;
using namespace clarus::render_test;
using Imath::V3d;
using Imath::V3f;

namespace {

/// Colour, depth and motion of two frames.
std::vector<RenderedFrame> pictures(const World& world, int first = 3) {
    RenderSettings settings = small_settings();
    std::vector<RenderedFrame> frames;
    for (const int frame : {first, first + 4}) {
        frames.push_back(render_frame(*world.scene, world.frame(frame), {0.25f, -0.125f}, settings));
    }
    return frames;
}

bool same(const std::vector<RenderedFrame>& a, const std::vector<RenderedFrame>& b) {
    return std::ranges::equal(a, b, [](const RenderedFrame& x, const RenderedFrame& y) {
        return x.color.values == y.color.values && x.depth.values == y.depth.values &&
               x.motion.values == y.motion.values;
    });
}

void check_worth_seeing(const std::vector<RenderedFrame>& frames) {
    for (const RenderedFrame& frame : frames) {
        const auto [least, most] = std::ranges::minmax(frame.depth.values);
        CHECK(least > 0);
        CHECK(least < 0.9);
        CHECK(most > 1.2 * least);
        std::set<int> tones;
        for (const float value : frame.color.values) {
            REQUIRE(std::isfinite(value));
            tones.insert(static_cast<int>(value * 64));
        }
        CHECK(tones.size() > 8);
        CHECK(std::ranges::any_of(frame.motion.values, [](float m) { return std::abs(m) > 0.01f; }));
    }
}

/// Coloured pillars on a plain; one thing that goes to and fro.
std::unique_ptr<Scene> pillars() {
    auto scene = std::make_unique<Scene>();
    scene->environment = even_light();
    Mesh ground{.material = scene->add_material({.texture = plain()})};
    ground.add_box({-60, -1, -60}, {60, 0, 60}, 5);
    scene->add_static({ground});
    for (int i = 0; i < 8; ++i) {
        Mesh pillar{.material = scene->add_material({.texture = plain()})};
        const float turn = 0.785f * static_cast<float>(i) + 0.3f;
        pillar.add_cylinder({12 * std::cos(turn), 0, 12 * std::sin(turn)},
                            {12 * std::cos(turn), 6, 12 * std::sin(turn)}, 0.8f, 0.8f, 12, 1);
        scene->add_static({pillar});
    }
    Mesh ball{.material = scene->add_material({.texture = plain()})};
    ball.add_sphere(V3f(0), 0.5f, 12, 1);
    scene->add_moving({ball}, [](double seconds) { return translation({3 * std::sin(seconds), 1, 0}); });
    scene->build();
    return scene;
}

bool equal(const CameraPose& a, const CameraPose& b) {
    return a.position == b.position && a.yaw == b.yaw && a.pitch == b.pitch && a.roll == b.roll && a.fov_y == b.fov_y;
}

std::string message_of(const std::string& name, ErrorKind kind) {
    try {
        make_world(name, 0);
    } catch (const Error& error) {
        CHECK(error.kind() == kind);
        return error.what();
    }
    FAIL("no error for ", name);
    return {};
}

}  // namespace

TEST_CASE("Films: cameras move, stand still, cut; every frame continues the one before") {
    const auto scene = pillars();
    const Stage stage{.reach = 20, .top = 5, .look_from = 30};
    const std::vector<Target> targets = {[](double t) { return V3d(3 * std::sin(t), 1, 0); }};
    const std::vector<ShotIdea> ideas = roaming_shots(*scene, stage, targets);
    int cuts = 0, frames_in_all = 0, first_cuts = 0;
    for (int number = 0; number < static_cast<int>(ideas.size()); ++number) {
        CAPTURE(number);
        Random random(static_cast<uint64_t>(number));
        const Film film(*scene, random, number, ideas);
        Random again(static_cast<uint64_t>(number));
        const Film twin(*scene, again, number, ideas);
        constexpr int frames = 400;
        int still = 0, since_still = 0, both_still = 0, worst_gap = 0, blocked = 0;
        for (int i = 0; i < frames; ++i) {
            const FrameState now = film(i), before = i > 0 ? film(i - 1) : now;
            REQUIRE(equal(now.camera, twin(i).camera));
            if (now.cut) {
                ++cuts;
                if (i < 24) ++first_cuts;
                CHECK(equal(now.previous_camera, now.camera));
            } else if (i > 0) {
                REQUIRE(equal(now.previous_camera, before.camera));
                REQUIRE(now.previous_seconds == before.seconds);
                CHECK((now.camera.position - before.camera.position).length() < 1);
            }
            const bool stands = equal(now.camera, now.previous_camera) && !now.cut;
            still += stands;
            both_still += stands && now.seconds == now.previous_seconds;
            since_still = stands ? 0 : since_still + 1;
            worst_gap = std::max(worst_gap, since_still);
            scene->set_time(now.seconds, now.seconds);
            if (clearance(*scene, now.camera.position, 1) < 0.2) ++blocked;
            ++frames_in_all;
        }
        CHECK(worst_gap <= 33);  // 32 moving frames, and a cut
        CHECK(still > 0.25 * frames);
        CHECK(still < 0.4 * frames);
        CHECK(both_still > 0.1 * frames);
        CHECK(both_still < 0.25 * frames);
        CHECK(blocked < 0.05 * frames);
    }
    CHECK(first_cuts == 0);
    CHECK(cuts >= static_cast<int>(ideas.size()));
    CHECK(cuts < frames_in_all / 60);
}

TEST_CASE("Worlds that are made up: the same name and path give the same pictures, others others") {
    const World world = make_world("procedural:1", 0);
    const std::vector<RenderedFrame> frames = pictures(world);
    check_worth_seeing(frames);
    CHECK(same(frames, pictures(make_world("procedural:1", 0))));
    const std::vector<RenderedFrame> other = pictures(make_world("procedural:5", 2));
    check_worth_seeing(other);
    CHECK_FALSE(same(frames, other));
}

TEST_CASE("Action: the same name and path give the same pictures; what is held out shares no kind with what is not") {
    const std::vector<RenderedFrame> frames = pictures(make_world("action:1", 0));
    check_worth_seeing(frames);
    CHECK(same(frames, pictures(make_world("action:1", 0))));
    CHECK_FALSE(same(frames, pictures(make_world("action:2", 0))));
    CHECK_FALSE(same(frames, pictures(make_world("action:1", 1))));
    const auto disjoint = [](const auto& a, const auto& b) {
        return std::ranges::none_of(a, [&](auto kind) { return std::ranges::find(b, kind) != b.end(); });
    };
    for (const uint64_t seed : {0, 1, 40, 899}) {
        for (const uint64_t reserved : {900, 901, 100000}) {
            const ActionKinds a = action_kinds(seed), b = action_kinds(reserved);
            CHECK(disjoint(a.patterns, b.patterns));
            CHECK(disjoint(a.actors, b.actors));
            CHECK(disjoint(a.screens, b.screens));
            CHECK(disjoint(a.cloths, b.cloths));
        }
    }
}

TEST_CASE("Action films: every frame continues the one before; most stop together, some cut") {
    int stopped = 0, all_stopped = 0, cuts = 0;
    constexpr int films = 60;
    for (int number = 0; number < films; ++number) {
        CAPTURE(number);
        Random random(static_cast<uint64_t>(number));
        const ActionFilm film(random);
        const FrameState last = film(ActionFilm::turn_frames - 1);
        stopped += last.seconds == last.previous_seconds;
        all_stopped += last.seconds == last.previous_seconds && equal(last.camera, last.previous_camera);
        for (int i = 1; i < 3 * ActionFilm::turn_frames; ++i) {
            const FrameState now = film(i), before = film(i - 1);
            cuts += now.cut;
            CHECK(equal(now.previous_camera, now.cut ? now.camera : before.camera));
            CHECK(now.previous_seconds == doctest::Approx(before.seconds));
            const double passed = now.seconds - now.previous_seconds;
            CHECK(passed >= 0);
            CHECK(passed <= 1.0 / 15 + 1e-9);
            if (i < ActionFilm::moving_frames - 6) CHECK(passed >= 1.0 / 120 - 1e-9);
        }
    }
    CHECK(stopped > films / 2);
    CHECK(stopped < films);
    CHECK(all_stopped > films / 4);
    CHECK(all_stopped < stopped);
    CHECK(cuts > 0);
}

TEST_CASE("The demo by its name is the demo") {
    const CameraPath path(2);
    const World demo{make_demo_scene(2, path), [&](int frame) { return path.frame(frame); }};
    const std::vector<RenderedFrame> frames = pictures(make_world("demo", 2));
    check_worth_seeing(frames);
    CHECK(same(frames, pictures(demo)));
}

TEST_CASE("A model file is a world: however large its units, on a ground, seen from cameras that move") {
    const TemporaryFolder folder;
    // A pyramid 30 km wide, far from its file's origin.
    std::ofstream(folder / "pyramid.obj") << "v 100000 0 0\nv 130000 0 0\nv 130000 0 30000\nv 100000 0 30000\n"
                                             "v 115000 20000 15000\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n";
    const std::string name = (folder / "pyramid.obj").string();
    const World world = make_world(name, 1);
    CHECK(distance_along(*world.scene, {0, 100, 0}, {0, -1, 0}, 1000).value() ==
          doctest::Approx(100 - 20 * 2.0 / 3).epsilon(0.001));
    check_worth_seeing(pictures(world));
    CHECK(same(pictures(world), pictures(make_world(name, 1))));
    CHECK_FALSE(same(pictures(world), pictures(make_world(name, 3))));
}

TEST_CASE("Names that stand for nothing are errors that say what there is") {
    for (const char* kind : {"procedural:SEED", "action:SEED"})
        CHECK(message_of("nowhere", ErrorKind::invalid_argument).find(kind) != std::string::npos);
    CHECK(message_of("action:fast", ErrorKind::invalid_argument).find("action:fast") != std::string::npos);
    CHECK(message_of("procedural:many", ErrorKind::invalid_argument).find("procedural:many") != std::string::npos);
    CHECK(message_of("procedural:", ErrorKind::invalid_argument).find("whole number") != std::string::npos);
    CHECK(message_of("interior:-1", ErrorKind::invalid_argument).find("whole number") != std::string::npos);
    if (torcs_tracks().empty()) {
        CHECK(message_of("torcs:forza", ErrorKind::file).find("apt-get install torcs-data") != std::string::npos);
    } else {
        CHECK(message_of("torcs:moon", ErrorKind::invalid_argument).find("forza") != std::string::npos);
    }
    for (const WorldKind& kind : world_kinds()) {
        CHECK_FALSE(kind.name.empty());
        CHECK_FALSE(kind.description.empty());
    }
}
