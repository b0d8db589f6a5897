#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <optional>
#include <string>

#include "child_process.h"
#include "clarus/jitter.h"
#include "opengl_scene.h"
#include "share_harness.h"

// The interposer of integrations/opengl under a program that knows nothing of it, on Xvfb.

using namespace clarus;
using namespace clarus::test;

namespace {

using Vec3 = std::array<double, 3>;

/// The number of a display of its own, once there is one; "" where there is no Xvfb.
class Display {
  public:
    Display() {
        if (std::system("command -v Xvfb >/dev/null 2>&1") != 0) return;
        int ends[2];
        REQUIRE(pipe(ends) == 0);
        const std::string descriptor = std::to_string(ends[1]);
        server_.emplace([&] {
            const int quiet = open("/dev/null", O_WRONLY);
            dup2(quiet, STDERR_FILENO);
            execlp("Xvfb", "Xvfb", "-displayfd", descriptor.c_str(), "-screen", "0", "320x240x24", "-nolisten", "tcp",
                   nullptr);
            return 127;
        });
        close(ends[1]);
        name_ = ':';
        char digit;
        while (read(ends[0], &digit, 1) == 1 && digit != '\n') name_ += digit;
        close(ends[0]);
        REQUIRE_MESSAGE(name_.size() > 1, "Xvfb did not start");
    }
    ~Display() {
        if (!server_) return;
        server_->signal(SIGTERM);
        server_->result();
    }
    const std::string& name() const { return name_; }

  private:
    std::optional<ChildProcess> server_;
    std::string name_;
};

/// Where the test cannot be made, a reason.
const char* reason_to_skip(const Display& display) {
    if (!*CLARUS_OPENGL_INTERPOSER) return "the interposer or OpenGL's library was left out of the build";
    if (display.name().empty()) return "there is no Xvfb";
    return nullptr;
}

Vec3 to_view(const camera_place& camera, Vec3 point) {
    for (int i = 0; i < 3; ++i) point[i] -= camera.eye[i];
    const double cy = std::cos(camera.yaw), sy = std::sin(camera.yaw);
    const Vec3 turned{cy * point[0] + sy * point[2], point[1], cy * point[2] - sy * point[0]};
    const double cp = std::cos(camera.pitch), sp = std::sin(camera.pitch);
    return {turned[0], cp * turned[1] - sp * turned[2], sp * turned[1] + cp * turned[2]};
}

Vec3 direction_to_world(const camera_place& camera, Vec3 direction) {
    const double cp = std::cos(camera.pitch), sp = std::sin(camera.pitch);
    const Vec3 level{direction[0], cp * direction[1] + sp * direction[2], cp * direction[2] - sp * direction[1]};
    const double cy = std::cos(camera.yaw), sy = std::sin(camera.yaw);
    return {cy * level[0] - sy * level[2], level[1], cy * level[2] + sy * level[0]};
}

enum Surface { sky, floor_surface, wall, held };

struct Seen {
    Surface surface = sky;
    double distance = INFINITY;  // along the view
    double x = 0, y = 0;         // in the frame before, in pixels; NaN where behind the camera
};

/// What lies at a place of the image, in pixels, y down.
Seen look(int frame, double x, double y) {
    const double half_width = scene_half_height * scene_width / scene_height;
    const Vec3 ray{(2 * x / scene_width - 1) * half_width, (1 - 2 * y / scene_height) * scene_half_height, -1};
    Seen seen;
    const double held_x = ray[0] * held_distance, held_y = ray[1] * held_distance;
    if (held_x > held_left && held_x < held_right && held_y > held_bottom && held_y < held_top)
        return {held, held_distance, x, y};

    const camera_place now = scene_camera_at(frame);
    const Vec3 along = direction_to_world(now, ray);
    const auto point = [&](double t) {
        return Vec3{now.eye[0] + t * along[0], now.eye[1] + t * along[1], now.eye[2] + t * along[2]};
    };
    const double to_floor = (floor_y - now.eye[1]) / along[1], to_wall = (wall_z - now.eye[2]) / along[2];
    if (to_wall > 0) {
        const Vec3 at = point(to_wall);
        if (at[1] > floor_y && at[1] < wall_top && std::abs(at[0]) < world_half_width) seen = {wall, to_wall, 0, 0};
    }
    if (to_floor > 0 && to_floor < seen.distance) {
        const Vec3 at = point(to_floor);
        if (at[2] > wall_z && at[2] < floor_first_z && std::abs(at[0]) < world_half_width)
            seen = {floor_surface, to_floor, 0, 0};
    }
    camera_place before = scene_camera_at(frame - 1);
    if (seen.surface == sky) std::copy_n(now.eye, 3, before.eye);  // it only turns
    const Vec3 then = to_view(before, point(seen.surface == sky ? 1 : seen.distance));
    seen.x = then[2] < 0 ? (then[0] / -then[2] / half_width + 1) / 2 * scene_width : NAN;
    seen.y = then[2] < 0 ? (1 - then[1] / -then[2] / scene_half_height) / 2 * scene_height : NAN;
    return seen;
}

/// Whether a place is so near to an edge that rounding decides what is there.
bool is_at_edge(int frame, double x, double y) {
    const Surface surface = look(frame, x, y).surface;
    for (const double dx : {-0.03, 0.03})
        for (const double dy : {-0.03, 0.03})
            if (look(frame, x + dx, y + dy).surface != surface) return true;
    return false;
}

struct Errors {
    int looked = 0, colors = 0, depths = 0, motions = 0;
    double largest_motion = 0;
};

void compare(const clarus_share_frame& frame, Errors& errors) {
    static const unsigned char colors[4][3] = {{0, 0, 0}, {0, 255, 0}, {0, 0, 255}, {255, 0, 0}};
    const int number = static_cast<int>(frame.number);
    const auto* color = static_cast<const unsigned char*>(frame.images[CLARUS_SHARE_COLOR].pixels);
    const auto* depth = static_cast<const float*>(frame.images[CLARUS_SHARE_DEPTH].pixels);
    const auto* motion = static_cast<const float*>(frame.images[CLARUS_SHARE_MOTION].pixels);
    for (int j = 0; j < scene_height; ++j)
        for (int i = 0; i < scene_width; ++i) {
            const double x = i + 0.5 + frame.jitter_x, y = j + 0.5 + frame.jitter_y;
            if (is_at_edge(number, x, y)) continue;
            const Seen seen = look(number, x, y);
            const int at = j * scene_width + i;
            ++errors.looked;
            errors.colors += std::memcmp(&color[4 * at], colors[seen.surface], 3) != 0;
            const double share = seen.surface == sky ? 1 : seen.distance / scene_far;
            errors.depths += std::abs(depth[at] - share) > 2e-3 * share;
            if (frame.reset) continue;
            const double dx = seen.x - x, dy = seen.y - y;
            const double error = std::hypot(motion[2 * at] - dx, motion[2 * at + 1] - dy);
            if (std::isnan(dx))
                errors.motions += !std::isnan(motion[2 * at]);
            else
                errors.motions += !(error < 0.02 + 0.002 * std::hypot(dx, dy));
            errors.largest_motion = std::fmax(errors.largest_motion, std::hypot(dx, dy));
        }
}

class Game {
  public:
    Game(const Display& display, const char* way, const char* policy)
        : process_([&] {
              setenv("DISPLAY", display.name().c_str(), 1);
              setenv("LIBGL_ALWAYS_SOFTWARE", "1", 1);
              setenv("LD_PRELOAD", CLARUS_OPENGL_INTERPOSER, 1);
              setenv("CLARUS_GL_STREAM", "scene", 1);
              setenv("CLARUS_GL_POLICY", policy, 1);
              execl(CLARUS_OPENGL_SCENE, "opengl_scene", way, nullptr);
              return 127;
          }) {}
    int end() {
        process_.signal(SIGTERM);
        return process_.result();
    }

  private:
    ChildProcess process_;
};

clarus_share_status connect(clarus_share_reader* reader) {
    clarus_share_status status = CLARUS_SHARE_NO_STREAM;
    for (int i = 0; i < 200 && (status == CLARUS_SHARE_NO_STREAM || status == CLARUS_SHARE_TIMED_OUT); ++i)
        status = clarus_share_reader_connect(reader, 100);
    return status;
}

}  // namespace

TEST_CASE("an OpenGL program's frames have the depth, motion and jitter that it was never asked for") {
    const Display display;
    if (const char* reason = reason_to_skip(display)) {
        MESSAGE("skipped: ", reason);
        return;
    }
    const RuntimeFolder runtime;
    for (const char* way : {"linked", "address", "symbol"}) {
        CAPTURE(way);
        Game game(display, way, "every");
        const SharedReader reader = open_reader("scene");
        REQUIRE(connect(reader.get()) == CLARUS_SHARE_OK);
        const clarus_share_description& description = *clarus_share_reader_description(reader.get());
        CHECK(description.resources[CLARUS_SHARE_COLOR].width == scene_width);
        CHECK(description.resources[CLARUS_SHARE_COLOR].height == scene_height);
        Errors errors;
        std::optional<uint64_t> last;
        int cuts = 0;
        for (int i = 0; i < 70; ++i) {
            clarus_share_frame frame;
            REQUIRE(clarus_share_reader_wait(reader.get(), 20000, &frame) == CLARUS_SHARE_OK);
            const int number = static_cast<int>(frame.number);
            CAPTURE(number);
            if (last) CHECK(frame.number == *last + 1);
            const bool is_cut = scene_is_turned(number) != scene_is_turned(number - 1);
            CHECK((frame.reset != 0) == (!last || is_cut));
            cuts += is_cut;
            last = frame.number;
            const Vec2 jitter = halton_jitter(number, 16);
            CHECK(frame.jitter_x == doctest::Approx(jitter.x));
            CHECK(frame.jitter_y == doctest::Approx(jitter.y));
            CHECK(frame.near_plane == doctest::Approx(scene_near).epsilon(1e-3));
            CHECK(frame.far_plane == doctest::Approx(scene_far).epsilon(1e-3));
            if (i % 5 == 0) compare(frame, errors);
            REQUIRE(clarus_share_reader_release(reader.get()) == CLARUS_SHARE_OK);
        }
        CHECK(cuts >= 2);
        CHECK(errors.looked > 14 * scene_width * scene_height * 0.9);
        CHECK(errors.largest_motion > 4);
        CHECK(errors.colors == 0);
        CHECK(errors.depths == 0);
        CHECK(errors.motions == 0);
        clarus_share_reader_refuse(reader.get(), "enough");
        CHECK(game.end() == 0);
    }
    CHECK(runtime.is_empty());
}

TEST_CASE("an OpenGL program does not wait for an upscaler that takes the newest frame") {
    const Display display;
    if (const char* reason = reason_to_skip(display)) {
        MESSAGE("skipped: ", reason);
        return;
    }
    const RuntimeFolder runtime;
    Game game(display, "linked", "newest");
    const SharedReader reader = open_reader("scene");
    REQUIRE(connect(reader.get()) == CLARUS_SHARE_OK);
    clarus_share_frame first, later;
    REQUIRE(clarus_share_reader_wait(reader.get(), 20000, &first) == CLARUS_SHARE_OK);
    do {
        REQUIRE(clarus_share_reader_release(reader.get()) == CLARUS_SHARE_OK);
        std::this_thread::sleep_for(std::chrono::milliseconds(100));
        REQUIRE(clarus_share_reader_wait(reader.get(), 20000, &later) == CLARUS_SHARE_OK);
    } while (later.number < first.number + 10);
    CHECK(clarus_share_reader_state(reader.get()).skipped > 0);
    CHECK(later.reset != 0);  // motion spans one frame
    Errors errors;
    compare(later, errors);
    CHECK(errors.looked > 0);
    CHECK(errors.colors == 0);
    CHECK(errors.depths == 0);
    clarus_share_reader_refuse(reader.get(), "enough");
    CHECK(game.end() == 0);
}

TEST_CASE("an OpenGL program is told what is wrong, and goes on") {
    const Display display;
    if (const char* reason = reason_to_skip(display)) {
        MESSAGE("skipped: ", reason);
        return;
    }
    const RuntimeFolder runtime;
    Game game(display, "linked", "sometimes");
    const SharedReader reader = open_reader("scene");
    CHECK(clarus_share_reader_connect(reader.get(), 500) == CLARUS_SHARE_NO_STREAM);
    CHECK(game.end() == 0);
    CHECK(runtime.is_empty());
}
