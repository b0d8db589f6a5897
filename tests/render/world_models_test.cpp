#include <doctest/doctest.h>
#include <zip.h>

#include <algorithm>
#include <fstream>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "clarus/error.h"
#include "clarus/log.h"
#include "io/image.h"
#include "render/worlds/furniture.h"
#include "render/worlds/import.h"
#include "render/worlds/track.h"
#include "temporary_folder.h"

using namespace clarus;
using namespace clarus::render;
using Imath::V2f;
using Imath::V3d;
using Imath::V3f;

namespace {

void write(const std::filesystem::path& path, const std::string& text) { std::ofstream(path) << text; }

/// Quarters in red, green over blue, white; the last one clear where `holes`.
void write_texture(const std::filesystem::path& path, bool holes = false) {
    constexpr int side = 16;
    io::Pixels image{{side, side}, 4, {}};
    for (int i = 0; i < side * side; ++i) {
        const bool right = i % side >= side / 2, below = i / side >= side / 2;
        const float clear = holes && right && below ? 0.0f : 1.0f;
        image.values.insert(image.values.end(),
                            {right == below ? 1.0f : 0.0f, right ? 1.0f : 0.0f, below ? 1.0f : 0.0f, clear});
    }
    io::write_image(path, image, io::SampleType::u8);
}

bool near(const V3f& a, const V3f& b) { return (a - b).length() < 1e-4f; }

/// The texture's colour where a mesh has this corner.
V3f color_at(const Scene& scene, const Mesh& mesh, const V3f& corner) {
    const auto found = std::ranges::find_if(mesh.positions, [&](const V3f& p) { return near(p, corner); });
    REQUIRE(found != mesh.positions.end());
    const V2f uv = mesh.uvs[static_cast<size_t>(found - mesh.positions.begin())];
    const Imath::V4f texel = scene.material(mesh.material).texture->sample(uv, 0);
    return {texel.x, texel.y, texel.z};
}

/// The sum of its triangles' normals, each as long as twice the area.
V3f area(const Mesh& mesh) {
    V3f sum(0);
    for (const auto& [a, b, c] : mesh.triangles) {
        sum += (mesh.positions[b] - mesh.positions[a]) % (mesh.positions[c] - mesh.positions[a]);
    }
    return sum;
}

std::string message_of(const std::function<void()>& action, ErrorKind kind) {
    try {
        action();
    } catch (const Error& error) {
        CHECK(error.kind() == kind);
        return error.what();
    }
    FAIL("no error");
    return {};
}

std::vector<std::string> warnings;

/// Collects warnings while it is there.
struct Warnings {
    Warnings() {
        warnings.clear();
        set_log_callback([](LogLevel level, std::string_view text) {
            if (level == LogLevel::warning) warnings.emplace_back(text);
        });
    }
    ~Warnings() { set_log_callback({}); }
};

// Unit square in the xy plane, facing +z; texture coordinates run up, as the format has them.
const std::string ac3d_square = R"(AC3Db
MATERIAL "paint" rgb 0.5 0 0 amb 0.2 0.2 0.2 emis 0 0 0 spec 0.5 0.5 0.5 shi 10 trans 0
MATERIAL "glass" rgb 1 1 1 amb 0.2 0.2 0.2 emis 0 0 0 spec 0 0 0 shi 10 trans 0.6
OBJECT world
kids 1
OBJECT group
name "holder"
loc 10 20 30
kids 2
OBJECT poly
name "square"
data 11
two
 words 1
texture "Folder\COLORS.PNG"
numvert 4
0 0 0
1 0 0
1 1 0
0 1 0
numsurf 1
SURF 0x20
mat 0
refs 4
0 0.25 0.25
1 0.75 0.25
2 0.75 0.75
3 0.25 0.75
kids 0
OBJECT poly
name "pane"
numvert 3
0 0 5
1 0 5
0 1 5
numsurf 2
SURF 0x20
mat 1
refs 3
0 0 0
1 1 0
2 0 1
SURF 0x22
mat 1
refs 2
0 0 0
1 1 0
kids 0
)";

}  // namespace

TEST_CASE("AC3D: places, directions, colours and textures, the latter whatever their names' case and folder") {
    const TemporaryFolder folder;
    write(folder / "model.ac", ac3d_square);
    std::filesystem::create_directory(folder / "images");
    write_texture(folder / "images" / "colors.png");
    Scene scene;
    const render::Model model = Importer(scene).load(folder / "model.ac");
    REQUIRE(model.size() == 2);
    const Mesh& square = model[0];
    CHECK(near(area(square), {0, 0, 2}));
    CHECK(std::ranges::all_of(square.normals, [](const V3f& n) { return near(n, {0, 0, 1}); }));
    // The texture's first row is at the top.
    CHECK(near(color_at(scene, square, {10, 21, 30}), {1, 0, 0}));
    CHECK(near(color_at(scene, square, {11, 21, 30}), {0, 1, 0}));
    CHECK(near(color_at(scene, square, {10, 20, 30}), {0, 0, 1}));
    CHECK(near(color_at(scene, square, {11, 20, 30}), {1, 1, 1}));
    const Material& paint = scene.material(square.material);
    CHECK(paint.tint.x == doctest::Approx(0.2176).epsilon(0.01));  // 0.5 decoded
    CHECK(paint.tint.y == 0);
    CHECK_FALSE(paint.blended);
    const Material& glass = scene.material(model[1].material);
    CHECK(glass.blended);
    CHECK(glass.opacity == doctest::Approx(0.4));
    CHECK(model[1].triangles.size() == 1);  // the line is left out
}

TEST_CASE("TORCS' AC3D: strips, normals, the first of several textures, children that are not there") {
    const TemporaryFolder folder;
    write(folder / "strip.acc", R"(AC3Db
MATERIAL "" rgb 0.4 0.4 0.4 amb 0.8 0.8 0.8 emis 0.6 0.6 0.6 spec 0.5 0.5 0.5 shi 50 trans 0
OBJECT world
kids 3
OBJECT poly
name "road"
texture "leaf.png" base
texture "other.png" tiled
texture empty_texture_no_mapping skids
texture empty_texture_no_mapping shad
numvert 6
0 0 0 0 1 0
0 0 -1 0 1 0
1 0 0 0 1 0
1 0 -1 0 1 0
2 0 0 0 1 0
2 0 -1 0 1 0
numsurf 1
SURF 0x14
mat 0
refs 8
1 0 100 9 9
0 0 99 9 9
1 0 100 9 9
2 1 99 9 9
3 1 100 9 9
4 2 99 9 9
5 2 100 9 9
5 2 100 9 9
kids 0
)");
    write_texture(folder / "leaf.png", true);
    Scene scene;
    const Warnings none;
    const render::Model model = Importer(scene).load(folder / "strip.acc");
    REQUIRE(model.size() == 1);
    CHECK(model[0].triangles.size() == 4);
    for (const auto& [a, b, c] : model[0].triangles) {
        const auto& p = model[0].positions;
        CHECK(std::abs(((p[b] - p[a]) % (p[c] - p[a])).y) == doctest::Approx(1));
    }
    CHECK(std::ranges::all_of(model[0].normals, [](const V3f& n) { return near(n, {0, 1, 0}); }));
    // 100 repeats away, brought near.
    CHECK(std::ranges::all_of(model[0].uvs, [](const V2f& uv) { return uv.y >= 0 && uv.y <= 1 && uv.x <= 2; }));
    CHECK(scene.material(model[0].material).cutout);
    CHECK(near(scene.material(model[0].material).tint, {1, 1, 1}));
    CHECK(warnings.empty());
}

TEST_CASE("OBJ: a texture, smooth normals that are not given, and a texture that is missing") {
    const TemporaryFolder folder;
    write(folder / "thing.mtl", "newmtl a\nKd 1 1 1\nmap_Kd colors.png\nnewmtl b\nKd 0 0.5 0\nmap_Kd nowhere.png\n");
    write(folder / "thing.obj",
          "mtllib thing.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 9\nvt 0.25 0.25\nvt 0.75 0.25\nvt 0.75 0.75\n"
          "vt 0.25 0.75\nusemtl a\nf 1/1 2/2 3/3 4/4\nusemtl b\nf 1/1 2/2 5/3\nf 2/2 3/3 5/4\n");
    write_texture(folder / "colors.png");
    Scene scene;
    const Warnings collected;
    const render::Model model = Importer(scene).load(folder / "thing.obj");
    REQUIRE(model.size() == 2);
    const Mesh& square = scene.material(model[0].material).texture->size().x > 1 ? model[0] : model[1];
    const Mesh& other = &square == &model[0] ? model[1] : model[0];
    CHECK(near(area(square), {0, 0, 2}));
    CHECK(near(square.normals[0], {0, 0, 1}));
    CHECK(near(color_at(scene, square, {0, 1, 0}), {1, 0, 0}));
    CHECK(near(color_at(scene, square, {1, 0, 0}), {1, 1, 1}));
    CHECK(scene.material(other.material).tint.y == doctest::Approx(0.2176).epsilon(0.01));
    REQUIRE(warnings.size() == 1);
    CHECK(warnings[0].find("nowhere.png") != std::string::npos);
}

TEST_CASE("glTF: data within the file, a node's place, colours, light of its own, transparency") {
    const TemporaryFolder folder;
    // Three positions as floats, then three indices: (0,0,0) (1,0,0) (0,1,0), 0 1 2.
    write(folder / "scene.gltf", R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
"nodes": [{"mesh": 0, "translation": [5, 6, 7], "scale": [2, 2, 2]}],
"meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
"materials": [{"pbrMetallicRoughness": {"baseColorFactor": [0.2, 0.4, 0.8, 0.25]}, "alphaMode": "BLEND",
               "emissiveFactor": [0.4, 0.8, 1.0]}],
"buffers": [{"byteLength": 42, "uri": "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAABAAIA"}],
"bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 6}],
"accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
              {"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"}]})");
    Scene scene;
    const render::Model model = Importer(scene).load(folder / "scene.gltf");
    REQUIRE(model.size() == 1);
    CHECK(near(bounds(model).low, {5, 6, 7}));
    CHECK(near(bounds(model).high, {7, 8, 7}));
    CHECK(near(area(model[0]), {0, 0, 4}));
    const Material& material = scene.material(model[0].material);
    CHECK(material.blended);
    CHECK(material.opacity == doctest::Approx(0.25));
    // What it sends out has the strongest channel of emissiveFactor.
    CHECK(material.tint.z * material.emission == doctest::Approx(1).epsilon(0.25));
}

TEST_CASE("Model files that are missing, broken or empty are named") {
    const TemporaryFolder folder;
    Scene scene;
    Importer importer(scene);
    const auto load = [&](const char* name) {
        return message_of([&] { importer.load(folder / name); }, ErrorKind::file);
    };
    CHECK(load("missing.obj").find("missing.obj") != std::string::npos);
    write(folder / "broken.gltf", "{\"asset\": ");
    CHECK(load("broken.gltf").find("broken.gltf") != std::string::npos);
    write(folder / "unknown.xyz", "what is this");
    CHECK(load("unknown.xyz").find("unknown.xyz") != std::string::npos);
    write(folder / "other.ac", "AC3Dc nothing");
    CHECK(load("other.ac").find("AC3Db") != std::string::npos);
    // Cut off in the middle of its vertices, then of its surfaces.
    for (const char* end : {"1 1 0", "2 0.75"}) {
        write(folder / "cut.ac", ac3d_square.substr(0, ac3d_square.find(end) + 1));
        CHECK(load("cut.ac").find("cut.ac") != std::string::npos);
    }
    for (const auto& [good, bad] : std::vector<std::pair<std::string, std::string>>{{"3 0.25 0.75", "7 0.25 0.75"},
                                                                                    {"refs 4", "refs 2000000000"},
                                                                                    {"mat 0", "mat 5"},
                                                                                    {"numvert 4", "numvert -4"},
                                                                                    {"refs 4", "refs x"}}) {
        std::string text = ac3d_square;
        write(folder / "bad.ac", text.replace(text.find(good), good.size(), bad));
        CHECK(load("bad.ac").find("bad.ac") != std::string::npos);
    }
    write(folder / "empty.ac", "AC3Db\nMATERIAL \"\" rgb 1 1 1 trans 0\nOBJECT world\nkids 0\n");
    CHECK(load("empty.ac").find("no triangles") != std::string::npos);
}

TEST_CASE("A track's lanes: straights, curves of changing radius, offsets and heights") {
    const TemporaryFolder folder;
    const auto describe = [&](const std::string& last) {
        write(folder / "track.xml", R"(<?xml version="1.0"?><params name="t" type="param">
<section name="Graphic"><attstr name="3d description" val="track.ac"/></section>
<section name="Main Track"><attnum name="width" unit="m" val="10"/>
<section name="Track Segments">
<section name="a"><attstr name="type" val="str"/><attnum name="lg" unit="m" val="100"/></section>
<section name="b"><attstr name="type" val="lft"/><attnum name="radius" unit="m" val="50"/><attnum name="arc" unit="deg" val="180"/></section>
<section name="c"><attstr name="type" val="str"/><attnum name="lg" unit="ft" val="328.08399"/></section>
)" + last + "</section></section></params>");
    };
    describe(
        R"(<section name="d"><attstr name="type" val="lft"/><attnum name="radius" unit="m" val="50"/><attnum name="end radius" unit="m" val="50"/><attnum name="arc" unit="deg" val="180"/></section>)");
    CHECK(track_model(folder / "track.xml") == "track.ac");

    // A ring road around that line, 7 m above zero, 1000 m east and 500 m north of the plan's origin.
    Piece road;
    road.name = "TKMN12";
    const auto place = [](double metres, double right) {
        constexpr double arc = 50 * 3.14159265358979;
        double x = metres, y = -right;
        if (metres > 100 && metres <= 100 + arc) {
            const double turn = (metres - 100) / 50;
            x = 100 + (50 + right) * std::sin(turn), y = 50 - (50 + right) * std::cos(turn);
        } else if (metres > 100 + arc && metres <= 200 + arc) {
            x = 200 + arc - metres, y = 100 + right;
        } else if (metres > 200 + arc) {
            const double turn = (metres - 200 - arc) / 50;
            x = -(50 + right) * std::sin(turn), y = 50 + (50 + right) * std::cos(turn);
        }
        return V3f(static_cast<float>(1000 + x), 7, static_cast<float>(-(500 + y)));
    };
    const double length = 200 + 100 * 3.14159265358979;
    for (int i = 0; i <= 1000; ++i) {
        for (const double side : {-5.0, 5.0}) road.mesh.positions.push_back(place(length * i / 1000, side));
        const auto n = static_cast<uint32_t>(2 * i);
        if (i > 0) road.mesh.triangles.insert(road.mesh.triangles.end(), {{n - 2, n - 1, n}, {n - 1, n + 1, n}});
    }
    road.mesh.normals.resize(road.mesh.positions.size(), {0, 1, 0});
    road.mesh.uvs.resize(road.mesh.positions.size());

    const Track track(folder / "track.xml", {road});
    CHECK(track.width() == 10);
    CHECK(track.length() == doctest::Approx(length).epsilon(0.003));
    const double scale = length / track.length();
    for (const double offset : {0.0, 3.0, -4.0}) {
        const Way lane = track.lane(offset);
        double worst = 0;
        for (double metres = 0; metres < track.length(); metres += 7.3) {
            worst = std::max(worst, (lane(metres) - V3d(place(metres * scale, offset))).length());
        }
        CHECK(worst < 0.1);
        CHECK((lane(track.length()) - lane(0)).length() < 1e-9);
    }

    describe("");
    CHECK(message_of([&] { Track(folder / "track.xml", {road}); }, ErrorKind::file).find("not close") !=
          std::string::npos);
}

TEST_CASE("Furniture: catalogue, size and turn of what an archive holds") {
    const TemporaryFolder folder;
    const auto archive = folder / "things.sh3f";
    const zipFile zip = zipOpen(archive.c_str(), APPEND_STATUS_CREATE);
    REQUIRE(zip);
    const auto add = [&](const char* name, const std::string& text) {
        zipOpenNewFileInZip(zip, name, nullptr, nullptr, 0, nullptr, 0, nullptr, Z_DEFLATED, Z_DEFAULT_COMPRESSION);
        zipWriteInFileInZip(zip, text.data(), static_cast<unsigned>(text.size()));
        zipCloseFileInZip(zip);
    };
    add("PluginFurnitureCatalog.properties",
        "# a "
        "comment\nname=whole\nname#1=Table\ncategory#1=Kitchen\nmodel#1=/t/table/table.obj\nwidth#1=120\nheight#1=75\n"
        "depth#1=80\ndropOnTopElevation#1=70.5\nelevation#1=5\nmodelRotation#1=0 0 -1 0 1 0 1 0 0\n"
        "name#2=Gone\nmodel#2=/t/gone.obj\nwidth#2=1\nheight#2=1\ndepth#2=1\n");
    // Longest along x in its file; the rotation lays that along z.
    add("t/table/table.obj", "v 0 0 0\nv 8 0 0\nv 8 0 3\nv 0 2 3\nf 1 2 3\nf 1 2 4\n");
    zipClose(zip, nullptr);
    const std::vector<Furniture> all = read_furniture(archive);
    REQUIRE(all.size() == 1);
    CHECK(all[0].name == "Table");
    CHECK(all[0].category == "Kitchen");
    CHECK(all[0].top == doctest::Approx(0.705));
    CHECK(all[0].elevation == doctest::Approx(0.05));
    Scene scene;
    Importer importer(scene);
    const render::Model model = load_furniture(importer, all[0]);
    CHECK(near(bounds(model).low, {-0.6f, 0, -0.4f}));
    CHECK(near(bounds(model).high, {0.6f, 0.75f, 0.4f}));
    // (8, 0, 0) goes to (0, 0, 8): the far end in depth.
    const auto has = [&](const V3f& corner) {
        return std::ranges::any_of(model, [&](const Mesh& mesh) {
            return std::ranges::any_of(mesh.positions, [&](const V3f& p) { return near(p, corner); });
        });
    };
    CHECK(has({0.6f, 0, 0.4f}));
    write(folder / "broken.sh3f", "not a zip");
    CHECK(message_of([&] { read_furniture(folder / "broken.sh3f"); }, ErrorKind::file).find("broken.sh3f") !=
          std::string::npos);
}
