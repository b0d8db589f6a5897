#include "render/mesh.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace clarus::render {
namespace {

using Imath::V2f;
using Imath::V3f;

constexpr float two_pi = 2 * std::numbers::pi_v<float>;

/// Two unit vectors that make a right-handed system with the unit vector `axis` in front.
std::array<V3f, 2> perpendicular(const V3f& axis) {
    const V3f side = (std::abs(axis.y) < 0.9f ? V3f(0, 1, 0) % axis : V3f(1, 0, 0) % axis).normalized();
    return {side, axis % side};
}

}  // namespace

void Mesh::append(const Mesh& other, const Imath::M44f& place) {
    const auto first = static_cast<uint32_t>(positions.size());
    for (size_t i = 0; i < other.positions.size(); ++i) {
        V3f normal;
        place.multDirMatrix(other.normals[i], normal);
        add_vertex(other.positions[i] * place, normal, other.uvs[i]);
    }
    for (const auto& [a, b, c] : other.triangles) triangles.push_back({a + first, b + first, c + first});
}

uint32_t Mesh::add_vertex(V3f position, V3f normal, V2f uv) {
    positions.push_back(position);
    normals.push_back(normal);
    uvs.push_back(uv);
    return static_cast<uint32_t>(positions.size() - 1);
}

void Mesh::add_grid_triangles(uint32_t first, int columns, int rows) {
    const uint32_t stride = static_cast<uint32_t>(columns) + 1;
    for (int row = 0; row < rows; ++row) {
        for (int column = 0; column < columns; ++column) {
            const uint32_t corner = first + static_cast<uint32_t>(row) * stride + static_cast<uint32_t>(column);
            triangles.push_back({corner, corner + 1, corner + stride + 1});
            triangles.push_back({corner, corner + stride + 1, corner + stride});
        }
    }
}

void Mesh::add_quad(const std::array<V3f, 4>& corners, V2f uv_low, V2f uv_high) {
    const V3f normal = ((corners[1] - corners[0]) % (corners[3] - corners[0])).normalized();
    const uint32_t first = add_vertex(corners[0], normal, uv_low);
    add_vertex(corners[1], normal, {uv_high.x, uv_low.y});
    add_vertex(corners[2], normal, uv_high);
    add_vertex(corners[3], normal, {uv_low.x, uv_high.y});
    triangles.push_back({first, first + 1, first + 2});
    triangles.push_back({first, first + 2, first + 3});
}

void Mesh::add_box(V3f low, V3f high, float repeat, const Imath::M44f& place) {
    for (int axis = 0; axis < 3; ++axis) {
        // Upright faces have the texture's v along y, so that bricks lie flat.
        const int across = axis == 0 ? 2 : 0, along = axis == 1 ? 2 : 1;
        for (const bool far_side : {false, true}) {
            std::array<V3f, 4> corners;
            for (int i = 0; i < 4; ++i) {
                V3f& corner = corners[i];
                corner[axis] = far_side ? high[axis] : low[axis];
                corner[across] = i == 1 || i == 2 ? high[across] : low[across];
                corner[along] = i >= 2 ? high[along] : low[along];
            }
            const V2f extent(high[across] - low[across], high[along] - low[along]);
            V3f outward(0);
            outward[axis] = far_side ? 1.0f : -1.0f;
            if ((((corners[1] - corners[0]) % (corners[3] - corners[0])) ^ outward) < 0) {
                std::swap(corners[0], corners[1]);
                std::swap(corners[2], corners[3]);
            }
            for (V3f& corner : corners) corner = corner * place;
            add_quad(corners, V2f(0), extent / repeat);
        }
    }
}

void Mesh::add_cylinder(V3f a, V3f b, float radius_a, float radius_b, int sides, float repeat, bool capped) {
    const V3f axis = (b - a).normalized();
    const auto [side, other] = perpendicular(axis);
    const float length = (b - a).length(), around = two_pi * std::max(radius_a, radius_b);
    const uint32_t first = static_cast<uint32_t>(positions.size());
    for (const bool end : {false, true}) {
        for (int i = 0; i <= sides; ++i) {
            const float angle = two_pi * static_cast<float>(i) / static_cast<float>(sides);
            const V3f outward = side * std::cos(angle) + other * std::sin(angle);
            const V3f normal = (outward * length + axis * (radius_a - radius_b)).normalized();
            add_vertex(
                end ? b + outward * radius_b : a + outward * radius_a, normal,
                {around / repeat * static_cast<float>(i) / static_cast<float>(sides), end ? length / repeat : 0});
        }
    }
    add_grid_triangles(first, sides, 1);
    if (!capped) return;
    for (const bool end : {false, true}) {
        const float radius = end ? radius_b : radius_a;
        const V3f normal = end ? axis : -axis;
        const uint32_t center = add_vertex(end ? b : a, normal, V2f(0));
        for (int i = 0; i <= sides; ++i) {
            const float angle = two_pi * static_cast<float>(i) / static_cast<float>(sides);
            const V2f circle = V2f(std::cos(angle), std::sin(angle)) * radius;
            const uint32_t rim =
                add_vertex((end ? b : a) + side * circle.x + other * circle.y, normal, circle / repeat);
            if (i > 0) triangles.push_back({center, rim - 1, rim});
        }
    }
}

void Mesh::add_sphere(V3f center, float radius, int sides, float repeats) {
    const uint32_t first = static_cast<uint32_t>(positions.size());
    const int rows = sides / 2;
    for (int row = 0; row <= rows; ++row) {
        const float latitude = static_cast<float>(row) / static_cast<float>(rows);
        for (int column = 0; column <= sides; ++column) {
            const float longitude = static_cast<float>(column) / static_cast<float>(sides);
            const float ring = std::sin(latitude * two_pi / 2), angle = longitude * two_pi;
            const V3f normal(ring * std::cos(angle), -std::cos(latitude * two_pi / 2), ring * std::sin(angle));
            add_vertex(center + normal * radius, normal, V2f(longitude, latitude / 2) * repeats);
        }
    }
    add_grid_triangles(first, sides, rows);
}

void Mesh::add_torus(V3f center, float ring_radius, float tube_radius, int ring_sides, int tube_sides, V2f repeats) {
    const uint32_t first = static_cast<uint32_t>(positions.size());
    for (int row = 0; row <= ring_sides; ++row) {
        const float along = static_cast<float>(row) / static_cast<float>(ring_sides);
        const V3f outward(std::cos(along * two_pi), 0, std::sin(along * two_pi));
        for (int column = 0; column <= tube_sides; ++column) {
            const float around = static_cast<float>(column) / static_cast<float>(tube_sides);
            const V3f normal = outward * std::cos(around * two_pi) + V3f(0, std::sin(around * two_pi), 0);
            add_vertex(center + outward * ring_radius + normal * tube_radius, normal,
                       {along * repeats.x, around * repeats.y});
        }
    }
    add_grid_triangles(first, tube_sides, ring_sides);
}

Mesh& mesh_of(Model& model, int material) {
    const auto found = std::ranges::find(model, material, &Mesh::material);
    if (found != model.end()) return *found;
    model.emplace_back().material = material;
    return model.back();
}

void append(Model& model, const Model& other, const Imath::M44f& place) {
    for (const Mesh& mesh : other) mesh_of(model, mesh.material).append(mesh, place);
}

}  // namespace clarus::render
