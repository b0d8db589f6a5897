#include "render/worlds/torcs.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/error.h"
#include "render/worlds/daylight.h"
#include "render/worlds/import.h"
#include "render/worlds/probe.h"
#include "render/worlds/seed.h"
#include "render/worlds/torcs_file.h"
#include "render/worlds/track.h"

// torcs-data: tracks and cars under the Free Art Licence (copyright Jean-Christophe Durieu, Bernhard Wymann, Andrew
// Sumner, Charalampos Alexopoulos, ViPeR and others; each folder's readme.txt names them). What is under another
// licence is left out: the track corkscrew and the cars 155-DTM, buggy and p406.

namespace clarus::render {
namespace {

namespace fs = std::filesystem;
using Imath::M44d;
using Imath::M44f;
using Imath::V3d;
using Imath::V3f;

const fs::path data = "/usr/share/games/torcs";

constexpr std::array cars = {"acura-nsx-sz", "baja-bug",  "car1-ow1",  "car1-stock1", "car1-stock2",
                             "car1-trb1",    "car1-trb3", "car2-trb1", "car3-trb1",   "car4-trb1",
                             "car5-trb1",    "car6-trb1", "car7-trb1", "car8-trb1"};

/// Descriptions of tracks by name.
std::map<std::string, fs::path> descriptions() {
    std::map<std::string, fs::path> found;
    std::error_code error;
    for (const char* kind : {"road", "oval", "dirt"}) {
        for (const fs::directory_entry& entry : fs::directory_iterator(data / "tracks" / kind, error)) {
            const std::string name = entry.path().filename().string();
            const fs::path file = entry.path() / (name + ".xml");
            if (name != "corkscrew" && fs::is_regular_file(file, error)) found[name] = file;
        }
    }
    return found;
}

struct Wheel {
    V3d center;  // of the car's space
    double radius;
    Model model;
};

struct Car {
    Model body;  // x ahead, y up, on the ground at the origin
    std::vector<Wheel> wheels;
};

/// The wheel's model, made as large as the tyre.
Wheel read_wheel(Importer& importer, const fs::path& file, pugi::xml_node car, const char* axle, const char* name) {
    const pugi::xml_node wheel = section(car, name);
    const double width = number(wheel, "tire width", 0.25), ratio = number(wheel, "tire height-width ratio", 0.4);
    const double radius = number(wheel, "rim diameter", 0.45) / 2 + width * ratio;
    const Model rough = importer.load(file);
    const Bounds box = bounds(rough);
    M44f fit;
    fit.translate(-box.center());
    M44f scale;
    const auto across = static_cast<float>(2 * radius) / std::max(box.size().x, box.size().y);
    scale.setScale(V3f(across, across, static_cast<float>(width) / box.size().z));
    Wheel made{V3d(number(section(car, axle), "xpos", 0), radius, -number(wheel, "ypos", 0)), radius, {}};
    append(made.model, rough, fit * scale);
    return made;
}

Rgba dark_patch(float u, float v) {
    const auto edge = [](float t) { return std::min(1.0f, 8 * std::min(t, 1 - t)); };
    return {0, 0, 0, 0.65f * edge(u) * edge(v)};
}

/// A soft dark patch on the road, where light from above does not come.
Mesh patch_below(const Model& body, int material) {
    const Bounds box = bounds(body);
    Mesh patch{.material = material};
    const float left = box.low.x - 0.3f, right = box.high.x + 0.3f, side = box.high.z + 0.3f;
    constexpr float height = 0.025f;
    patch.add_quad({V3f(left, height, side), {right, height, side}, {right, height, -side}, {left, height, -side}},
                   Imath::V2f(0), Imath::V2f(1));
    return patch;
}

Car read_car(Importer& importer, const std::string& name) {
    const fs::path folder = data / "cars" / name;
    const pugi::xml_document document = read_torcs_file(folder / (name + ".xml"));
    const pugi::xml_node description = document.child("params");
    std::vector<Piece> body = read_model(folder / (name + ".acc"));
    for (Piece& piece : body) {
        piece.look.highlight = 1, piece.look.sharpness = 8;  // paint
        // The body's outside and inside lie in one another, since the game draws only what faces the viewer.
        constexpr float thickness = 0.002f;
        for (size_t i = 0; i < piece.mesh.positions.size(); ++i) {
            piece.mesh.positions[i] += piece.mesh.normals[i] * thickness;
        }
    }
    Car car{importer.load(body, folder), {}};
    const std::string wheels = text(section(description, "Graphic Objects"), "3d wheel directory");
    const fs::path file = data / "wheels" / (wheels.empty() ? "trb1-1" : wheels) / "wheel0.acc";
    for (const auto& [axle, wheel] : {std::pair{"Front Axle", "Front Right Wheel"},
                                      {"Front Axle", "Front Left Wheel"},
                                      {"Rear Axle", "Rear Right Wheel"},
                                      {"Rear Axle", "Rear Left Wheel"}}) {
        car.wheels.push_back(read_wheel(importer, file, description, axle, wheel));
    }
    return car;
}

/// Cars that drive together. Even paths have one half of the kinds, odd ones the other, so that what is learnt on the
/// one can be judged on the other.
class Pack {
  public:
    Pack(Scene& scene, const Track& track, int path, Random& random) {
        Importer importer(scene, {data / "data" / "textures"});
        const int count = 3 + random.below(4);
        const double room = track.width() - 3, speed = random.uniform(18, 45);
        const double start = random.uniform(0, track.length());
        constexpr int half = cars.size() / 2;
        const int first = random.below(half);
        const int patch = scene.add_material({.texture = std::make_shared<Texture>(6, dark_patch), .blended = true});
        for (int i = 0; i < count; ++i) {
            const auto kind = static_cast<size_t>((first + i * 5) % half * 2 + path % 2);
            // A lane each, so that they can overtake.
            const double offset = room * (i / (count - 1.0) - 0.5);
            drivers_.push_back({track.lane(offset - 0.7), track.lane(offset + 0.7), start - random.uniform(0, 14) * i,
                                speed * random.uniform(0.94, 1.06)});
            Car car = read_car(importer, cars[kind]);
            car.body.push_back(patch_below(car.body, patch));
            add(scene, std::move(car), drivers_.back());
        }
    }

    /// Where the pack is about, in metres along the track.
    double metres(double seconds) const { return drivers_.front().metres(seconds); }
    double speed() const { return drivers_.front().speed; }

    struct Driver {
        Way left, right;  // below the wheels
        double start, speed;

        double metres(double seconds) const { return start + speed * seconds; }
        V3d place(double seconds) const { return (left(metres(seconds)) + right(metres(seconds))) / 2; }
        M44d pose(double seconds) const {
            const double at = metres(seconds);
            constexpr double half_base = 1.3;
            const V3d back = left(at - half_base) + right(at - half_base);
            const V3d ahead = (left(at + half_base) + right(at + half_base) - back).normalized();
            const V3d up = ((right(at) - left(at)) % ahead).normalized(), aside = ahead % up, here = place(seconds);
            return {ahead.x, ahead.y, ahead.z, 0, up.x,   up.y,   up.z,   0,
                    aside.x, aside.y, aside.z, 0, here.x, here.y, here.z, 1};
        }
    };
    const std::vector<Driver>& drivers() const { return drivers_; }

  private:
    static void add(Scene& scene, Car car, const Driver& driver) {
        scene.add_moving(std::move(car.body), [driver](double seconds) { return driver.pose(seconds); });
        for (Wheel& wheel : car.wheels) {
            const V3d center = wheel.center;
            const double radius = wheel.radius;
            scene.add_moving(std::move(wheel.model), [=](double seconds) {
                M44d roll, axle;
                roll.rotate(V3d(0, 0, -driver.metres(seconds) / radius));
                axle.setTranslation(center);
                return roll * axle * driver.pose(seconds);
            });
        }
    }

    std::vector<Driver> drivers_;
};

std::vector<ShotIdea> race_shots(const Scene& scene, const Track& track, const Pack& pack) {
    const auto any_driver = [pack](Random& random) {
        return pack.drivers()[static_cast<size_t>(random.below(static_cast<int>(pack.drivers().size())))];
    };
    const Way middle = track.lane(0);
    const double half = track.width() / 2, length = track.length();
    const auto chase = [=](Random& random, double) {
        const Pack::Driver driver = any_driver(random);
        const double behind = random.uniform(4.5, 11) * (random.below(5) == 0 ? -1 : 1);
        const double height = random.uniform(1.2, 3), fov = random.uniform(0.8, 1.2);
        return hand_held(
            random,
            [=](double seconds) {
                const double at = driver.metres(seconds);
                const V3d eye = (driver.left(at - behind) + driver.right(at - behind)) / 2 + V3d(0, height, 0);
                return looking(eye, driver.place(seconds) + V3d(0, 0.8, 0), fov);
            },
            0.6);
    };
    const auto cockpit = [=](Random& random, double now) {
        const Way lane = track.lane(random.uniform(-0.5, 0.5) * half);
        return drive(random, lane, pack.metres(now) - random.uniform(-10, 40), now,
                     pack.speed() * random.uniform(0.9, 1.05), random.uniform(0.9, 1.4));
    };
    const auto lonely_drive = [=](Random& random, double now) {
        const Way lane = track.lane(random.uniform(-0.7, 0.7) * half);
        return drive(random, lane, random.uniform(0, length), now, random.uniform(10, 40), random.uniform(0.9, 2));
    };
    /// Beside the track where the pack comes by, or anywhere.
    const auto trackside = [=, &scene](Random& random, double metres) {
        const V3d at = middle(metres), ahead = middle(metres + 1) - middle(metres - 1);
        const double side = (half + random.uniform(1, 14)) * (random.below(2) ? 1 : -1);
        V3d eye = at + V3d(-ahead.z, 0, ahead.x).normalized() * side;
        eye.y = ground_below(scene, eye + V3d(0, 6, 0)).value_or(eye.y) + random.uniform(1.2, 3);
        return eye;
    };
    const auto watch = [=](Random& random, double now) {
        const Pack::Driver driver = any_driver(random);
        const V3d eye = trackside(random, driver.metres(now + random.uniform(0.3, 2)));
        return hand_held(random, follow(random, eye, [=](double t) { return driver.place(t) + V3d(0, 0.6, 0); }), 0.7);
    };
    const auto fly_over = [=](Random& random, double now) {
        const bool with_pack = random.below(2);
        const double start = with_pack ? pack.metres(now) - random.uniform(10, 50) : random.uniform(0, length);
        return fly(random, middle, start, now, with_pack ? pack.speed() : random.uniform(8, 35), random.uniform(5, 28));
    };
    const auto stand = [=](Random& random, double now) {
        const double metres = random.below(2) ? pack.metres(now + random.uniform(0, 2)) : random.uniform(0, length);
        const V3d eye = trackside(random, metres), at = middle(metres + random.uniform(-40, 40));
        const double fov = random.uniform(0.5, 1.2);
        return hand_held(
            random, [=](double) { return looking(eye, at + V3d(0, 1, 0), fov); }, random.uniform(0.8, 2));
    };
    const auto stroll = [=](Random& random, double now) {
        const double side = half + random.uniform(0.5, 4);
        const Way lane = track.lane(side * (random.below(2) ? 1 : -1));
        return walk(random, lane, random.uniform(0, length), now, random.uniform(1.5, 5));
    };
    const auto turn = [=](Random& random, double now) {
        const double metres = random.below(2) ? pack.metres(now + 1) : random.uniform(0, length);
        return turn_fast(random, trackside(random, metres), now);
    };
    const auto circle = [=](Random& random, double now) {
        const Pack::Driver driver = any_driver(random);
        return orbit(
            random, [=](double t) { return driver.place(t) + V3d(0, 0.7, 0); }, random.uniform(5, 12),
            random.uniform(0.8, 4), now);
    };
    return {chase, watch, lonely_drive, fly_over, cockpit, stand, circle, turn, stroll};
}

}  // namespace

std::vector<std::string> torcs_tracks() {
    std::vector<std::string> names;
    for (const auto& [name, file] : descriptions()) names.push_back(name);
    return names;
}

World make_torcs_world(const std::string& name, int path) {
    const auto known = descriptions();
    if (known.empty()) {
        fail(ErrorKind::file, "there are no tracks in {}; they come with: apt-get install torcs-data", data.string());
    }
    const auto found = known.find(name);
    if (found == known.end()) {
        fail(ErrorKind::invalid_argument, "there is no track \"{}\"; there are: {}", name,
             fmt::join(torcs_tracks(), " "));
    }
    const fs::path folder = found->second.parent_path();
    std::vector<Piece> pieces = read_model(folder / track_model(found->second));
    for (Piece& piece : pieces) piece.look.highlight = 0;  // the same for tar, leaves and grass there
    const Track track(found->second, pieces);

    Random random(seed_of(name, static_cast<uint64_t>(path)));
    World world{std::make_unique<Scene>(), {}};
    Scene& scene = *world.scene;
    scene.environment = daylight(random);
    scene.add_static(Importer(scene, {data / "data" / "textures"}).load(pieces, folder));
    const Pack pack(scene, track, path, random);
    scene.build();
    world.frame = Film(scene, random, path, race_shots(scene, track, pack));
    return world;
}

}  // namespace clarus::render
