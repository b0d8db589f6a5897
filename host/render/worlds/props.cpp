#include "render/worlds/props.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <string_view>

#include "render/worlds/placement.h"
#include "render/worlds/procedural.h"

namespace clarus::render {
namespace {

using Imath::V2f;
using Imath::V3f;

constexpr float two_pi = 2 * std::numbers::pi_v<float>;

float between(Random& random, double low, double high) { return static_cast<float>(random.uniform(low, high)); }

V3f any_direction(Random& random) {
    const float y = between(random, -1, 1), angle = between(random, 0, two_pi), ring = std::sqrt(1 - y * y);
    return {ring * std::cos(angle), y, ring * std::sin(angle)};
}

/// A square card with the whole texture on it.
void add_card(Mesh& mesh, V3f center, V3f right, V3f up) {
    mesh.add_quad({center - right - up, center + right - up, center + right + up, center - right + up}, V2f(0), V2f(1));
}

void add_rod(Mesh& mesh, V3f a, V3f b, float radius, int sides = 6) {
    mesh.add_cylinder(a, b, radius, radius, sides, 0.5f, sides > 4);
}

}  // namespace

Palette demo_palette(Scene& scene, Random& random) {
    Palette palette;
    std::map<std::string_view, std::shared_ptr<const Texture>> drawn;
    const auto texture_of = [&](std::string_view name) {
        auto& texture = drawn[name];
        if (!texture) texture = procedural_texture(name);
        return texture;
    };
    const auto plain = [&](std::string_view texture, V3f tint = V3f(1)) {
        return scene.add_material({.texture = texture_of(texture), .tint = tint});
    };
    const auto glossy = [&](std::string_view texture, V3f tint, float highlight, int sharpness, float mirror) {
        return scene.add_material({texture_of(texture), tint, highlight, sharpness, mirror});
    };
    const auto holed = [&](std::string_view texture, V3f tint) {
        return scene.add_material({.texture = texture_of(texture), .tint = tint, .cutout = true});
    };
    const auto colored = [&](float low, float high) {
        return V3f(between(random, low, high), between(random, low, high), between(random, low, high));
    };
    palette.tiles = glossy("tiles", V3f(1), 0.25f, 6, 0.02f);
    palette.slabs = glossy("concrete", {1.05f, 0.95f, 0.8f}, 0.2f, 5, 0.02f);
    palette.cobbles = glossy("cobbles", V3f(1), 0.1f, 4, 0);
    palette.asphalt = plain("asphalt");
    palette.lawn = plain("grass");
    palette.field = plain("grass", {1.1f, 1.0f, 0.8f});
    palette.brick = plain("brick");
    palette.plaster = plain("plaster", colored(0.75f, 1.1f));
    palette.planks = glossy("planks", V3f(1), 0.1f, 4, 0.01f);
    palette.concrete = plain("concrete");
    palette.bark = plain("bark");
    palette.leaves = holed("leaves", V3f(1));
    palette.blades = holed("blades", V3f(1));
    palette.lattice = holed("lattice", V3f(1));
    palette.white_paint = plain("plaster", V3f(1.05f));
    palette.rail = glossy("concrete", {0.25f, 0.30f, 0.32f}, 1, 6, 0.08f);
    palette.wire = plain("concrete", V3f(0.06f));
    palette.chrome = glossy("concrete", V3f(0.4f), 2, 8, 0.65f);
    palette.gold = glossy("plates", {1.2f, 0.75f, 0.22f}, 2, 7, 0.25f);
    palette.checker = glossy("checker", V3f(1), 1, 7, 0.04f);
    palette.sign = glossy("sign", V3f(1), 0.2f, 6, 0.02f);
    palette.stripes = plain("stripes");
    palette.rubber = plain("concrete", V3f(0.08f));
    palette.glass = glossy("concrete", {0.05f, 0.06f, 0.07f}, 3, 9, 0.12f);
    palette.lamp_glow =
        scene.add_material({.texture = texture_of("plaster"), .tint = {1, 0.9f, 0.6f}, .emission = 1.5f});
    palette.plates = glossy("plates", V3f(1), 0.5f, 5, 0.05f);
    for (int& facade : palette.facades) facade = plain("facade", colored(0.65f, 1.15f));
    for (int& roof : palette.roofs) roof = plain("shingles", colored(0.6f, 1.3f));
    for (int& paint : palette.paints) paint = glossy("plaster", colored(0.05f, 1.1f), 1.5f, 8, 0.05f);
    for (int& foliage_kind : palette.foliage)
        foliage_kind = holed("leaves", {between(random, 0.7, 1.7), between(random, 0.7, 1.1), 1});
    return palette;
}

Model tree(const Palette& palette, Random& random) {
    Model model;
    const float height = between(random, 2.2, 3.8), crown = between(random, 1.3, 2.1);
    Mesh trunk{.material = palette.bark};
    trunk.add_cylinder(V3f(0), {0, height, 0}, 0.17f, 0.09f, 8, 0.8f, false);
    const V3f top(0, height, 0);
    Mesh crown_cards{.material = palette.foliage[random.below(4)]};
    for (int branch = 0; branch < 9; ++branch) {
        V3f out = any_direction(random);
        out.y = std::abs(out.y) * 0.8f;
        const V3f end = top + out * crown * 0.75f;
        trunk.add_cylinder({0, height * between(random, 0.7, 1), 0}, end, 0.05f, 0.015f, 4, 0.8f, false);
    }
    for (int card = 0; card < 110; ++card) {
        const V3f out = any_direction(random) * V3f(1, 0.8f, 1);
        const V3f center = top + V3f(0, crown * 0.4f, 0) + out * crown * std::cbrt(between(random, 0.15, 1));
        const V3f right = any_direction(random), up = (right % any_direction(random)).normalized();
        add_card(crown_cards, center, right * 0.42f, up * 0.42f);
    }
    model.push_back(std::move(trunk));
    model.push_back(std::move(crown_cards));
    return model;
}

Model bush(const Palette& palette, Random& random) {
    Mesh cards{.material = palette.foliage[random.below(4)]};
    for (int card = 0; card < 26; ++card) {
        V3f center = any_direction(random) * V3f(0.55f, 0.4f, 0.55f) + V3f(0, 0.45f, 0);
        const V3f right = any_direction(random), up = (right % any_direction(random)).normalized();
        add_card(cards, center, right * 0.3f, up * 0.3f);
    }
    return {cards};
}

Model grass_tuft(const Palette& palette, Random& random) {
    Mesh cards{.material = palette.blades};
    const float size = between(random, 0.15, 0.32), angle = between(random, 0, two_pi);
    for (int card = 0; card < 3; ++card) {
        const float a = angle + static_cast<float>(card) * two_pi / 6;
        add_card(cards, {0, size * 0.96f, 0}, V3f(std::cos(a), 0, std::sin(a)) * size, {0, size, 0});
    }
    return {cards};
}

Model bench(const Palette& palette) {
    Mesh wood{.material = palette.planks}, iron{.material = palette.rail};
    for (int slat = 0; slat < 5; ++slat) {
        const float z = -0.2f + 0.1f * static_cast<float>(slat);
        wood.add_box({-0.8f, 0.43f, z}, {0.8f, 0.46f, z + 0.07f}, 1.2f);
    }
    for (int slat = 0; slat < 4; ++slat) {
        const float y = 0.52f + 0.1f * static_cast<float>(slat);
        wood.add_box({-0.8f, y, -0.27f}, {0.8f, y + 0.065f, -0.24f}, 1.2f);
    }
    for (const float x : {-0.7f, 0.66f}) {
        iron.add_box({x, 0, -0.25f}, {x + 0.04f, 0.9f, -0.22f}, 1);
        iron.add_box({x, 0, 0.2f}, {x + 0.04f, 0.43f, 0.23f}, 1);
        iron.add_box({x, 0.4f, -0.25f}, {x + 0.04f, 0.43f, 0.25f}, 1);
    }
    return {wood, iron};
}

Model lamp(const Palette& palette) {
    Mesh iron{.material = palette.rail}, glow{.material = palette.lamp_glow};
    iron.add_cylinder(V3f(0), {0, 0.5f, 0}, 0.12f, 0.06f, 8, 1);
    add_rod(iron, {0, 0.5f, 0}, {0, 4.2f, 0}, 0.035f, 8);
    add_rod(iron, {0, 4.2f, 0}, {0.7f, 4.4f, 0}, 0.02f);
    add_rod(iron, {0, 3.7f, 0}, {0.5f, 4.33f, 0}, 0.01f);
    iron.add_cylinder({0.7f, 4.4f, 0}, {0.7f, 4.28f, 0}, 0.05f, 0.2f, 10, 1, false);
    glow.add_sphere({0.7f, 4.27f, 0}, 0.1f, 12, 1);
    return {iron, glow};
}

Model crates(const Palette& palette, Random& random) {
    Model model;
    Mesh& wood = mesh_of(model, palette.planks);
    const auto crate = [&](V3f at, float size) {
        wood.add_box({-size / 2, 0, -size / 2}, {size / 2, size, size / 2}, size,
                     placed(V3f(0, between(random, -0.3, 0.3), 0), at));
    };
    crate({-0.45f, 0, 0}, 0.8f);
    crate({0.45f, 0, 0.15f}, 0.75f);
    crate({-0.1f, 0.8f, 0.05f}, 0.6f);
    return model;
}

Model barrel(const Palette& palette, Random& random) {
    Mesh body{.material = palette.paints[random.below(4)]}, hoops{.material = palette.plates};
    body.add_cylinder(V3f(0), {0, 0.9f, 0}, 0.3f, 0.3f, 20, 1);
    for (const float y : {0.05f, 0.3f, 0.6f, 0.85f}) hoops.add_torus({0, y, 0}, 0.3f, 0.018f, 20, 6, {8, 1});
    return {body, hoops};
}

Model column(const Palette& palette, Random& random) {
    Mesh stone{.material = palette.plaster};
    const float height = between(random, 2.6, 4.2);
    stone.add_box({-0.4f, 0, -0.4f}, {0.4f, 0.25f, 0.4f}, 1);
    stone.add_box({-0.4f, height, -0.4f}, {0.4f, height + 0.2f, 0.4f}, 1);
    // Fluting: a core with round ribs.
    add_rod(stone, {0, 0.25f, 0}, {0, height, 0}, 0.26f, 16);
    for (int rib = 0; rib < 16; ++rib) {
        const float angle = two_pi * static_cast<float>(rib) / 16;
        const V3f out(0.26f * std::cos(angle), 0, 0.26f * std::sin(angle));
        stone.add_cylinder(out + V3f(0, 0.25f, 0), out * 0.9f + V3f(0, height, 0), 0.035f, 0.03f, 6, 0.5f, false);
    }
    return {stone};
}

Model railing(const Palette& palette, float length) {
    Mesh iron{.material = palette.rail};
    for (const float y : {0.12f, 1.0f, 1.08f}) add_rod(iron, {0, y, 0}, {length, y, 0}, y > 1.05f ? 0.025f : 0.012f);
    const int bars = static_cast<int>(length / 0.12f);
    for (int bar = 0; bar <= bars; ++bar) {
        const float x = length * static_cast<float>(bar) / static_cast<float>(bars);
        const bool post = bar % 12 == 0;
        add_rod(iron, {x, 0, 0}, {x, post ? 1.2f : 1.0f, 0}, post ? 0.03f : 0.009f, post ? 8 : 4);
    }
    return {iron};
}

Model wire_fence(const Palette& palette, float length) {
    Mesh net{.material = palette.lattice}, posts{.material = palette.rail};
    net.add_quad({V3f(0, 0.05f, 0), {length, 0.05f, 0}, {length, 1.85f, 0}, {0, 1.85f, 0}}, V2f(0),
                 V2f(length, 1.8f) * 1.6f);
    const int spans = std::max(1, static_cast<int>(length / 2));
    for (int post = 0; post <= spans; ++post) {
        const float x = length * static_cast<float>(post) / static_cast<float>(spans);
        add_rod(posts, {x, 0, 0}, {x, 2, 0}, 0.03f, 8);
    }
    add_wire(posts, {0, 1.95f, 0}, {length, 1.95f, 0}, 0.02f, 0.006f);
    return {net, posts};
}

Model sign_board(const Palette& palette, float width, float height) {
    Mesh board{.material = palette.sign}, frame{.material = palette.planks};
    const float low = 1, high = 1 + height;
    for (const float side : {1.0f, -1.0f}) {
        const float x = side * width / 2;
        board.add_quad(
            {V3f(-x, high, 0.02f * side), {x, high, 0.02f * side}, {x, low, 0.02f * side}, {-x, low, 0.02f * side}},
            V2f(0), V2f(1));
        frame.add_box({x - 0.04f, 0, -0.04f}, {x + 0.04f, high + 0.1f, 0.04f}, 1);
    }
    frame.add_box({-width / 2, low - 0.05f, -0.015f}, {width / 2, high + 0.05f, 0.015f}, 1);
    return {board, frame};
}

Model stall(const Palette& palette, Random& random) {
    Model model;
    Mesh& posts = mesh_of(model, palette.planks);
    for (const float x : {-1.2f, 1.2f}) {
        for (const float z : {-0.8f, 0.8f}) posts.add_box({x - 0.04f, 0, z - 0.04f}, {x + 0.04f, 2.2f, z + 0.04f}, 1);
    }
    posts.add_box({-1.3f, 0.8f, 0.3f}, {1.3f, 0.88f, 0.9f}, 1.5f);
    posts.add_box({-1.2f, 0, 0.75f}, {1.2f, 0.8f, 0.8f}, 1.5f);
    const int first = palette.paints[random.below(4)];
    for (int band = 0; band < 14; ++band) {
        const float left = -1.4f + 0.2f * static_cast<float>(band), right = left + 0.2f;
        Mesh& cloth = mesh_of(model, band % 2 ? palette.white_paint : first);
        cloth.add_quad({V3f(left, 2.15f, 1.1f), {right, 2.15f, 1.1f}, {right, 2.7f, 0}, {left, 2.7f, 0}}, V2f(0),
                       V2f(0.2f, 1));
        cloth.add_quad({V3f(left, 2.7f, 0), {right, 2.7f, 0}, {right, 2.15f, -1.1f}, {left, 2.15f, -1.1f}}, V2f(0),
                       V2f(0.2f, 1));
        cloth.add_quad({V3f(left, 1.98f, 1.1f), {right, 1.98f, 1.1f}, {right, 2.15f, 1.1f}, {left, 2.15f, 1.1f}},
                       V2f(0), V2f(0.2f, 0.2f));
    }
    for (int fruit = 0; fruit < 40; ++fruit) {
        Mesh& heap = mesh_of(model, palette.paints[fruit / 10]);
        heap.add_sphere({-1.1f + 0.55f * static_cast<float>(fruit / 10) + between(random, 0, 0.4), 0.93f,
                         between(random, 0.38, 0.82)},
                        0.055f, 8, 1);
    }
    return model;
}

Model house(const Palette& palette, Random& random, float width, float depth, float height) {
    Model model;
    const float x = width / 2, z = depth / 2;
    const bool flat = height > 12 || random.below(3) == 0;
    mesh_of(model, palette.brick).add_box({-x - 0.06f, 0, -z - 0.06f}, {x + 0.06f, 1.1f, z + 0.06f}, 1.6f);
    mesh_of(model, palette.facades[random.below(4)]).add_box({-x, 1.1f, -z}, {x, height, z}, 9);
    Mesh& stone = mesh_of(model, palette.plaster);
    for (float y = 1.1f; y < height; y += 4.5f) {
        stone.add_box({-x - 0.12f, y - 0.08f, -z - 0.12f}, {x + 0.12f, y + 0.08f, z + 0.12f}, 2);
    }
    Mesh& iron = mesh_of(model, palette.rail);
    if (flat) {
        stone.add_box({-x - 0.25f, height, -z - 0.25f}, {x + 0.25f, height + 0.4f, z + 0.25f}, 2);
        mesh_of(model, palette.plates).add_box({-x / 2, height + 0.4f, -z / 2}, {x / 2, height + 1.8f, 0}, 2);
        for (int mast = 0; mast < 3; ++mast) {
            const V3f foot(between(random, -x, x) * 0.8f, height + 0.4f, between(random, -z, z) * 0.8f);
            const float mast_height = between(random, 1.5, 4);
            add_rod(iron, foot, foot + V3f(0, mast_height, 0), 0.025f);
            for (int bar = 1; bar < 6; ++bar) {
                const V3f at = foot + V3f(0, mast_height * (1 - 0.08f * static_cast<float>(bar)), 0);
                add_rod(iron, at - V3f(0.5f, 0, 0), at + V3f(0.5f, 0, 0), 0.01f, 4);
            }
        }
    } else {
        const float ridge = height + 0.45f * depth;
        Mesh& roof = mesh_of(model, palette.roofs[random.below(4)]);
        const float slope = std::hypot(z + 0.4f, ridge - height), eaves = height - 0.15f;
        for (const float side : {-1.0f, 1.0f}) {
            roof.add_quad({V3f(-side * (x + 0.3f), eaves, side * (z + 0.4f)),
                           {side * (x + 0.3f), eaves, side * (z + 0.4f)},
                           {side * (x + 0.3f), ridge, 0},
                           {-side * (x + 0.3f), ridge, 0}},
                          V2f(0), V2f(width + 0.6f, slope) / 2.5f);
            Mesh& gable = mesh_of(model, palette.brick);
            gable.add_quad({V3f(side * x, height, -z),
                            {side * x, height, z},
                            {side * x, ridge - 0.1f, 0.01f},
                            {side * x, ridge - 0.1f, -0.01f}},
                           V2f(0), V2f(depth, ridge - height) / 1.6f);
        }
        const float chimney = between(random, -0.6, 0.6) * x;
        mesh_of(model, palette.brick)
            .add_box({chimney - 0.4f, height, z * 0.3f}, {chimney + 0.4f, ridge + 0.8f, z * 0.3f + 0.6f}, 1.6f);
    }
    // A balcony with thin bars over the door, towards +z.
    const float level = 5.6f;
    if (height > level + 2) {
        stone.add_box({-1.6f, level - 0.12f, z}, {1.6f, level, z + 1}, 2);
        append(model, railing(palette, 3.2f), move(V3f(-1.6f, level, z + 0.97f)));
    }
    mesh_of(model, palette.planks).add_box({-0.7f, 0, z + 0.05f}, {0.7f, 2.3f, z + 0.12f}, 1.4f);
    return model;
}

Model pylon(const Palette& palette, float height) {
    Mesh iron{.material = palette.rail};
    const auto corner = [&](int i, float t) {
        const float half = std::lerp(1.4f, 0.25f, t);
        return V3f(i == 0 || i == 3 ? -half : half, height * t, i < 2 ? -half : half);
    };
    constexpr int storeys = 9;
    for (int i = 0; i < 4; ++i) {
        add_rod(iron, corner(i, 0), corner(i, 1), 0.06f);
        for (int storey = 0; storey < storeys; ++storey) {
            const float low = static_cast<float>(storey) / storeys, high = static_cast<float>(storey + 1) / storeys;
            add_rod(iron, corner(i, low), corner((i + 1) % 4, high), 0.03f, 4);
            add_rod(iron, corner((i + 1) % 4, low), corner(i, high), 0.03f, 4);
            add_rod(iron, corner(i, high), corner((i + 1) % 4, high), 0.03f, 4);
        }
    }
    add_rod(iron, {-2.2f, height * 0.9f, 0}, {2.2f, height * 0.9f, 0}, 0.05f);
    return {iron};
}

Model car(const Palette& palette, Random& random) {
    Mesh body{.material = palette.paints[random.below(4)]}, glass{.material = palette.glass},
        chrome{.material = palette.chrome}, tyres{.material = palette.rubber};
    body.add_box({-2, 0.35f, -0.85f}, {2, 0.85f, 0.85f}, 2);
    body.add_box({-1.3f, 1.38f, -0.72f}, {0.8f, 1.45f, 0.72f}, 2);
    glass.add_box({-1.4f, 0.85f, -0.74f}, {0.95f, 1.38f, 0.74f}, 2);
    for (const float x : {-1.42f, -0.3f, 0.9f}) {
        for (const float z : {-0.75f, 0.71f}) body.add_box({x, 0.85f, z}, {x + 0.06f, 1.4f, z + 0.04f}, 2);
    }
    for (const float x : {-2.06f, 2.0f}) {
        chrome.add_box({x, 0.4f, -0.86f}, {x + 0.06f, 0.5f, 0.86f}, 1);
        for (const float z : {-0.6f, 0.6f}) chrome.add_sphere({x + 0.02f, 0.66f, z}, 0.1f, 10, 1);
    }
    for (const float x : {-1.25f, 1.25f}) {
        for (const float z : {-0.88f, 0.68f}) {
            tyres.add_cylinder({x, 0.34f, z}, {x, 0.34f, z + 0.2f}, 0.34f, 0.34f, 16, 0.5f);
            chrome.add_cylinder({x, 0.34f, z - 0.01f}, {x, 0.34f, z + 0.21f}, 0.17f, 0.17f, 10, 0.5f);
        }
    }
    return {body, glass, chrome, tyres};
}

Model rotor(const Palette& palette, float radius) {
    Mesh wings{.material = palette.white_paint}, frame{.material = palette.rail};
    add_rod(frame, {0, 0, -0.3f}, {0, 0, 0.15f}, 0.09f, 10);
    for (int blade = 0; blade < 4; ++blade) {
        const float angle = two_pi * static_cast<float>(blade) / 4;
        const V3f out(std::cos(angle), std::sin(angle), 0), side(-out.y, out.x, 0);
        add_rod(frame, V3f(0), out * radius, 0.02f);
        for (int bar = 2; bar <= 10; ++bar) {
            const V3f at = out * (radius * static_cast<float>(bar) / 10);
            add_rod(frame, at, at + side * 0.42f, 0.008f, 4);
        }
        const V3f low = out * (radius * 0.25f) + side * 0.05f, high = out * (radius * 0.97f) + side * 0.05f;
        wings.add_quad({low, high, high + side * 0.3f + V3f(0, 0, 0.08f), low + side * 0.3f + V3f(0, 0, 0.08f)}, V2f(0),
                       V2f(radius, 0.3f));
    }
    return {wings, frame};
}

Model rod_drum(const Palette& palette, float radius, float height) {
    Mesh rods{.material = palette.chrome}, plates{.material = palette.stripes};
    for (int rod = 0; rod < 28; ++rod) {
        const float angle = two_pi * static_cast<float>(rod) / 28;
        const V3f out(radius * std::cos(angle), 0, radius * std::sin(angle));
        add_rod(rods, out, out + V3f(0, height, 0), 0.014f, 6);
    }
    for (const float y : {0.0f, height})
        plates.add_cylinder({0, y - 0.05f, 0}, {0, y + 0.05f, 0}, radius + 0.06f, radius + 0.06f, 32, 1);
    return {rods, plates};
}

Model ring_sculpture(const Palette& palette, float radius) {
    Mesh gold{.material = palette.gold}, ball{.material = palette.checker};
    gold.add_torus(V3f(0), radius, radius * 0.09f, 48, 12, {16, 2});
    Mesh upright{.material = palette.gold};
    upright.add_torus(V3f(0), radius * 0.75f, radius * 0.07f, 48, 12, {12, 2});
    Imath::M44f tip;
    tip.rotate(V3f(two_pi / 4, 0, 0));
    gold.append(upright, tip);
    ball.add_sphere(V3f(0), radius * 0.4f, 32, 2);
    return {gold, ball};
}

Model spoked_wheel(const Palette& palette, float radius) {
    Mesh iron{.material = palette.rail}, rim{.material = palette.stripes};
    rim.add_torus(V3f(0), radius, radius * 0.04f, 48, 8, {24, 1});
    for (int spoke = 0; spoke < 24; ++spoke) {
        const float angle = two_pi * static_cast<float>(spoke) / 24;
        add_rod(iron, V3f(0), V3f(std::cos(angle), 0, std::sin(angle)) * radius, 0.008f, 4);
    }
    add_rod(iron, {0, -0.15f, 0}, {0, 0.15f, 0}, 0.08f, 10);
    Imath::M44f upright;
    upright.rotate(V3f(two_pi / 4, 0, 0));
    Model model;
    append(model, {iron, rim}, upright);
    return model;
}

void add_wire(Mesh& mesh, V3f from, V3f to, float sag, float radius) {
    constexpr int pieces = 16;
    V3f last = from;
    for (int piece = 1; piece <= pieces; ++piece) {
        const float t = static_cast<float>(piece) / pieces;
        const V3f next = from + (to - from) * t - V3f(0, 4 * sag * t * (1 - t), 0);
        mesh.add_cylinder(last, next, radius, radius, 4, 1, false);
        last = next;
    }
}

}  // namespace clarus::render
