#include "render/worlds/invented_things.h"

#include <cmath>
#include <numbers>

#include "render/worlds/lettering.h"
#include "render/worlds/noise.h"

namespace clarus::render {
namespace {

using Imath::M44f;
using Imath::V2f;
using Imath::V3f;

constexpr float two_pi = 2 * std::numbers::pi_v<float>;

float between(Random& random, double low, double high) { return static_cast<float>(random.uniform(low, high)); }

M44f turned(float around_y, const V3f& to) {
    M44f place;
    place.rotate(V3f(0, around_y, 0));
    for (int i = 0; i < 3; ++i) place[3][i] = to[i];
    return place;
}

V3f any_direction(Random& random) {
    const float y = between(random, -1, 1), angle = between(random, 0, two_pi), ring = std::sqrt(1 - y * y);
    return {ring * std::cos(angle), y, ring * std::sin(angle)};
}

void add_rod(Mesh& mesh, const V3f& a, const V3f& b, float radius, int sides = 6) {
    mesh.add_cylinder(a, b, radius, radius, sides, 0.5f, sides > 4);
}

}  // namespace

Materials::Materials(Scene& scene, Random& random, const ColorScheme& colors, bool at_night) : night(at_night) {
    std::vector<std::shared_ptr<const Texture>> surfaces;
    for (int i = 0; i < 14; ++i) surfaces.push_back(invented_surface(random, colors, between(random, 0.12, 0.65)));
    const auto plain_texture = std::make_shared<Texture>(0, [](float, float) { return Rgba{1, 1, 1, 1}; });
    const auto add = [&](Material material) { return scene.add_material(std::move(material)); };
    const auto solid = [&] {
        Material material{.texture = surfaces[static_cast<size_t>(random.below(14))]};
        for (int i = 0; i < 3; ++i) material.tint[i] = between(random, 0.8, 1.1);
        if (random.below(3) == 0) {
            material.highlight = between(random, 0.1, 1.5);
            material.sharpness = 4 + random.below(5);
            material.mirror = random.below(3) == 0 ? between(random, 0.02, 0.15) : 0;
        }
        return add(material);
    };
    const auto painted = [&](float brightness, float highlight, int sharpness, float mirror) {
        return add({plain_texture, colors.pick(random, brightness), highlight, sharpness, mirror});
    };
    for (int* surface : {&brick, &plaster, &planks, &concrete, &bark, &checker, &stripes, &plates}) *surface = solid();
    for (int* surface : {&tiles, &slabs, &cobbles, &asphalt, &soil, &rock}) {
        *surface = add({.texture = invented_surface(random, colors, between(random, 0.1, 0.35))});
    }
    for (int& wall : walls) wall = solid();
    for (int& facade : facades) facade = solid();
    for (int& roof : roofs) roof = solid();
    for (int& paint : paints) paint = painted(between(random, 0.15, 0.7), 1.5f, 8, 0.05f);
    const V3f leaf = mix(V3f(0.12f, 0.24f, 0.04f), colors.pick(random, 0.22f), between(random, 0, 0.8));
    const V3f grass = mix(V3f(0.10f, 0.20f, 0.04f), leaf, 0.5f);
    lawn = field = add({.texture = invented_surface(random, colors, 0.45f), .tint = grass * 3});
    for (int& kind : foliage) {
        kind = add({.texture = invented_leaves(random, leaf * between(random, 0.6, 1.5)), .cutout = true});
    }
    leaves = foliage[0];
    blades = add({.texture = invented_leaves(random, grass), .cutout = true});
    lattice = add({.texture = invented_mesh(random, colors.pick(random, 0.35f)), .cutout = true});
    white_paint = painted(0.75f, 0.2f, 4, 0);
    rail = painted(between(random, 0.05, 0.5), 1, 6, 0.06f);
    wire = painted(0.04f, 0, 4, 0);
    chrome = add({plain_texture, V3f(0.4f), 2, 8, 0.65f});
    gold = add({plain_texture, colors.pick(random, 0.6f), 2, 7, 0.3f});
    rubber = painted(0.04f, 0.2f, 4, 0);
    glass = window = add({plain_texture, V3f(0.04f, 0.05f, 0.06f), 3, 9, 0.12f});
    lit_window = add({.texture = invented_surface(random, colors, 0.6f),
                      .tint = {1, 0.85f, 0.6f},
                      .emission = between(random, 0.5, 1.2)});
    pane = add({.texture = plain_texture,
                .tint = colors.pick(random, 0.4f),
                .highlight = 2,
                .sharpness = 8,
                .mirror = 0.06f,
                .blended = true,
                .opacity = between(random, 0.1, 0.4)});
    lamp_glow = add({.texture = plain_texture, .tint = {1, 0.9f, 0.7f}, .emission = 2});
    for (int& glow : glows) {
        glow = add({.texture = plain_texture, .tint = colors.pick(random, 0.8f), .emission = between(random, 1, 3)});
    }
    for (int& face : signs) {
        const V3f ground = colors.pick(random, between(random, 0.02, 0.8));
        const V3f ink = ground.y > 0.3f ? colors.pick(random, 0.06f) : colors.pick(random, 0.8f);
        face = add({.texture = invented_sign(random, ground, ink), .emission = at_night ? 1.5f : 0.0f});
    }
    sign = signs[0];
}

const Palette& Materials::with_any_sign(Random& random) {
    sign = signs[static_cast<size_t>(random.below(static_cast<int>(signs.size())))];
    return *this;
}

Model tower(const Materials& materials, Random& random, float width, float depth, int floors) {
    Model model;
    const float storey = between(random, 2.7, 4), height = storey * static_cast<float>(floors), x = width / 2,
                z = depth / 2;
    const int wall = materials.any_wall(random), trim = materials.any_wall(random);
    const float spacing = between(random, 1.6, 4), share = between(random, 0.35, 0.8);
    const float window_height = storey * between(random, 0.35, 0.75), bar = between(random, 0.03, 0.12);
    const int lit_of_ten = materials.night ? 2 + random.below(6) : random.below(2);
    const bool crossed = random.below(2), ledges = random.below(2);
    mesh_of(model, wall).add_box({-x, 0, -z}, {x, height, z}, between(random, 1.5, 5));
    mesh_of(model, trim)
        .add_box({-x - 0.2f, height, -z - 0.2f}, {x + 0.2f, height + between(random, 0.2, 1.2), z + 0.2f}, 2);
    for (int side = 0; side < 4; ++side) {
        const float length = side % 2 ? depth : width, out = side % 2 ? x : z;
        M44f place;
        place.rotate(V3f(0, static_cast<float>(side) * two_pi / 4, 0));
        const int columns = std::max(1, static_cast<int>((length - 1) / spacing));
        for (int floor = 0; floor < floors; ++floor) {
            const float low = storey * static_cast<float>(floor) + 0.25f * storey, high = low + window_height;
            for (int column = 0; column < columns; ++column) {
                const float middle =
                    (static_cast<float>(column) + 0.5f) * length / static_cast<float>(columns) - length / 2;
                const float half = share * spacing / 2, left = middle - half, right = middle + half;
                const bool lit = random.below(10) < lit_of_ten;
                Mesh opening;
                opening.add_quad({V3f(left, high, out + 0.01f),
                                  {left, low, out + 0.01f},
                                  {right, low, out + 0.01f},
                                  {right, high, out + 0.01f}},
                                 V2f(0), V2f(1));
                mesh_of(model, lit ? materials.lit_window : materials.window).append(opening, place);
                Mesh& frame = mesh_of(model, trim);
                frame.add_box({left - bar, low - bar, out}, {right + bar, low, out + 0.12f}, 1, place);
                frame.add_box({left - bar, high, out}, {right + bar, high + bar, out + 0.12f}, 1, place);
                if (crossed)
                    frame.add_box({middle - bar / 3, low, out}, {middle + bar / 3, high, out + 0.05f}, 1, place);
            }
            if (ledges)
                mesh_of(model, trim)
                    .add_box({-length / 2, low - 0.3f, out}, {length / 2, low - 0.2f, out + 0.2f}, 1, place);
        }
    }
    for (int mast = random.below(4); mast > 0; --mast) {
        const V3f foot(between(random, -x, x) * 0.8f, height, between(random, -z, z) * 0.8f);
        add_rod(mesh_of(model, materials.rail), foot, foot + V3f(0, between(random, 1, 4), 0), 0.03f);
    }
    return model;
}

Model pavilion(Materials& materials, Random& random, float width, float depth, int floors) {
    Model model;
    const float storey = between(random, 2.8, 4), x = width / 2, z = depth / 2;
    const int slab = materials.any_wall(random), back = materials.any_wall(random), pillar = materials.any_wall(random);
    const bool panes = random.below(2);
    for (int floor = 0; floor <= floors; ++floor) {
        const float y = storey * static_cast<float>(floor);
        mesh_of(model, slab).add_box({-x, y, -z}, {x, y + 0.2f, z}, 2);
        if (floor == floors) break;
        const float low = y + 0.2f, high = y + storey;
        mesh_of(model, back).add_box({-x, low, -z}, {x, high, -z + 0.15f}, 3);
        const int columns = 2 + random.below(3);
        for (int i = 0; i <= columns; ++i) {
            const float at = -x + 0.2f + (width - 0.4f) * static_cast<float>(i) / static_cast<float>(columns);
            add_rod(mesh_of(model, pillar), {at, low, z - 0.2f}, {at, high, z - 0.2f}, 0.12f, 10);
        }
        if (panes) {
            mesh_of(model, materials.pane)
                .add_quad({V3f(-x, low, z), {x, low, z}, {x, high, z}, {-x, high, z}}, V2f(0), V2f(1));
        } else {
            append(model, railing(materials, width), turned(0, {-x, low, z - 0.05f}));
        }
        mesh_of(model, materials.lamp_glow)
            .add_box({-x * 0.6f, high - 0.06f, -0.1f}, {x * 0.6f, high - 0.02f, 0.1f}, 1);
        for (int thing = 2 + random.below(4); thing > 0; --thing) {
            const M44f place = turned(between(random, 0, two_pi),
                                      {between(random, -x + 1, x - 1), low, between(random, -z + 1, z - 1)});
            switch (random.below(4)) {
                case 0:
                    append(model, crates(materials, random), place);
                    break;
                case 1:
                    append(model, bench(materials), place);
                    break;
                case 2:
                    append(model, column(materials, random), place);
                    break;
                default:
                    append(model, barrel(materials, random), place);
            }
        }
        mesh_of(model, materials.with_any_sign(random).sign)
            .add_quad({V3f(-1, high - 0.5f, -z + 0.17f),
                       {1, high - 0.5f, -z + 0.17f},
                       {1, high - 1.5f, -z + 0.17f},
                       {-1, high - 1.5f, -z + 0.17f}},
                      V2f(0), V2f(1));
    }
    return model;
}

Model boulder(const Materials& materials, Random& random, float radius) {
    Mesh mesh{.material = materials.rock};
    mesh.add_sphere(V3f(0), 1, 28, between(random, 2, 4));
    const int salt = random.below(1 << 20);
    const V3f squash(between(random, 0.7, 1.3), between(random, 0.5, 1), between(random, 0.7, 1.3));
    const float roughness = between(random, 0.2, 0.6);
    for (V3f& p : mesh.positions) {
        const float turn = std::atan2(p.z, p.x) / two_pi + 0.5f, level = 0.5f + 0.49f * p.y;
        const float bump =
            1 + roughness * (2 * fractal(turn, level, 4, 3, salt) - 1) * std::sqrt(std::max(0.0f, 1 - p.y * p.y));
        p = p * squash * (radius * bump) + V3f(0, 0.3f * radius, 0);
    }
    return {mesh};
}

Model conifer(const Materials& materials, Random& random) {
    Model model;
    const float height = between(random, 3.5, 9), spread = height * between(random, 0.18, 0.32);
    mesh_of(model, materials.bark).add_cylinder(V3f(0), {0, height, 0}, 0.035f * height, 0.02f, 7, 0.8f, false);
    Mesh& cards = mesh_of(model, materials.foliage[static_cast<size_t>(random.below(4))]);
    const int whorls = 9 + random.below(6);
    for (int whorl = 0; whorl < whorls; ++whorl) {
        const float t = (static_cast<float>(whorl) + 0.5f) / static_cast<float>(whorls),
                    y = height * (0.15f + 0.85f * t);
        const float reach = spread * (1.08f - t);
        for (int branch = 0; branch < 7; ++branch) {
            const float angle = two_pi * (static_cast<float>(branch) / 7 + between(random, 0, 0.1)) + t * 9;
            const V3f out(std::cos(angle), -0.35f, std::sin(angle)), side(-out.z * 0.35f, 0, out.x * 0.35f);
            const V3f root(0, y, 0);
            cards.add_quad({root - side * reach, root + out * reach - side * reach, root + out * reach + side * reach,
                            root + side * reach},
                           V2f(0), V2f(1));
        }
    }
    return model;
}

Model works(const Materials& materials, Random& random) {
    Model model;
    const int tanks = 1 + random.below(3);
    for (int tank = 0; tank < tanks; ++tank) {
        const float radius = between(random, 0.8, 1.8), height = between(random, 2, 6),
                    x = 4.2f * static_cast<float>(tank);
        const V3f foot(x, 0, 0), top(x, height, 0);
        Mesh& shell = mesh_of(model, materials.any_wall(random));
        shell.add_cylinder(foot, top, radius, radius, 28, 2);
        shell.add_sphere(top - V3f(0, radius * 0.6f, 0), radius, 24, 4);
        Mesh& iron = mesh_of(model, materials.rail);
        for (float y = 0.4f; y < height; y += 1.3f) iron.add_torus({x, y, 0}, radius, 0.04f, 28, 6, {8, 1});
        for (const float side : {-0.2f, 0.2f})
            add_rod(iron, {x + side, 0, radius + 0.15f}, {x + side, height + 0.5f, radius + 0.15f}, 0.02f);
        for (float y = 0.3f; y < height; y += 0.3f)
            add_rod(iron, {x - 0.2f, y, radius + 0.15f}, {x + 0.2f, y, radius + 0.15f}, 0.012f, 4);
        Mesh& pipes = mesh_of(model, materials.paints[static_cast<size_t>(random.below(4))]);
        for (int pipe = 0; pipe < 4; ++pipe) {
            const float y = between(random, 0.3, 0.9 * height), z = between(random, -1, 1) * radius,
                        thick = between(random, 0.05, 0.18);
            add_rod(pipes, {x, y, z}, {x + 3.6f, y, z}, thick, 10);
            add_rod(pipes, {x + 3.6f, y, z}, {x + 3.6f, 0, z}, thick, 10);
            pipes.add_sphere({x + 3.6f, y, z}, thick * 1.15f, 10, 1);
        }
    }
    return model;
}

Model scaffold(const Materials& materials, Random& random, float width, int floors) {
    Model model;
    Mesh &iron = mesh_of(model, materials.rail), &boards = mesh_of(model, materials.planks);
    const int bays = std::max(1, static_cast<int>(width / 2));
    const float height = 2 * static_cast<float>(floors);
    for (int bay = 0; bay <= bays; ++bay) {
        const float x = 2 * static_cast<float>(bay);
        for (const float z : {0.0f, 1.0f}) add_rod(iron, {x, 0, z}, {x, height + 1, z}, 0.025f, 8);
        if (bay == bays) break;
        for (int floor = 1; floor <= floors; ++floor) {
            const float y = 2 * static_cast<float>(floor);
            boards.add_box({x, y, 0.05f}, {x + 2, y + 0.05f, 0.95f}, 1.2f);
            for (const float rail_y : {y + 0.5f, y + 1.0f})
                add_rod(iron, {x, rail_y, 1}, {x + 2, rail_y, 1}, 0.018f, 5);
            if (random.below(2)) add_rod(iron, {x, y - 2, 0}, {x + 2, y, 0}, 0.018f, 5);
        }
    }
    return model;
}

Model neon(Materials& materials, Random& random) {
    Model model;
    const float height = between(random, 2.5, 6), half = between(random, 0.6, 1.6);
    add_rod(mesh_of(model, materials.rail), V3f(0), {0, height, 0}, 0.06f, 8);
    Mesh& tube = mesh_of(model, materials.glows[static_cast<size_t>(random.below(3))]);
    const float low = height, high = height + half;
    for (const float y : {low, high}) add_rod(tube, {-half, y, 0.06f}, {half, y, 0.06f}, 0.025f, 8);
    for (const float x : {-half, half}) add_rod(tube, {x, low, 0.06f}, {x, high, 0.06f}, 0.025f, 8);
    Mesh& face = mesh_of(model, materials.with_any_sign(random).sign);
    for (const float side : {1.0f, -1.0f}) {
        const float x = side * half, z = 0.03f * side;
        face.add_quad({V3f(-x, high, z), {x, high, z}, {x, low, z}, {-x, low, z}}, V2f(0), V2f(1));
    }
    return model;
}

Model sculpture(const Materials& materials, Random& random, float radius) {
    Model model;
    const std::array finishes = {materials.chrome,
                                 materials.gold,
                                 materials.checker,
                                 materials.any_wall(random),
                                 materials.paints[static_cast<size_t>(random.below(4))],
                                 materials.glows[static_cast<size_t>(random.below(3))]};
    for (int part = 2 + random.below(6); part > 0; --part) {
        Mesh& mesh = mesh_of(model, finishes[static_cast<size_t>(random.below(static_cast<int>(finishes.size())))]);
        const V3f at = any_direction(random) * (0.5f * radius);
        const float size = radius * between(random, 0.15, 0.5);
        M44f tilt;
        tilt.rotate(V3f(between(random, 0, two_pi), between(random, 0, two_pi), 0));
        Mesh piece;
        switch (random.below(5)) {
            case 0:
                piece.add_sphere(at, size, 28, 3);
                break;
            case 1:
                piece.add_torus(at, size, size * between(random, 0.08, 0.3), 40, 12, {12, 2});
                break;
            case 2:
                piece.add_box(at - V3f(0.7f * size), at + V3f(0.7f * size), radius);
                break;
            case 3:
                for (int rod = 0; rod < 14; ++rod)
                    add_rod(piece, at, at + any_direction(random) * (1.6f * size), 0.012f * radius, 5);
                break;
            default:
                for (int blade = 0; blade < 5; ++blade) {
                    const float angle = two_pi * static_cast<float>(blade) / 5;
                    const V3f out(std::cos(angle) * radius, std::sin(angle) * radius, 0),
                        side(-out.y * 0.15f, out.x * 0.15f, 0.1f * radius);
                    piece.add_quad({V3f(0), out, out + side, side}, V2f(0), V2f(1, 0.2f));
                }
        }
        mesh.append(piece, tilt);
    }
    return model;
}

}  // namespace clarus::render
