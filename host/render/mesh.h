#pragma once

#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include <array>
#include <cstdint>
#include <deque>
#include <vector>

namespace clarus::render {

/// Triangles of one material. Shapes are added to it by the functions below, in metres; textures lie on them with
/// `repeat` metres to a repetition unless told otherwise.
struct Mesh {
    int material = 0;  // index into the scene's materials
    std::vector<Imath::V3f> positions{}, normals{};
    std::vector<Imath::V2f> uvs{};
    std::vector<std::array<uint32_t, 3>> triangles{};

    /// All of another mesh, moved by `place`; the material stays.
    void append(const Mesh& other, const Imath::M44f& place = {});
    /// Corners in turn; (u, v) run from `uv_low` at the first to `uv_high` at the third.
    void add_quad(const std::array<Imath::V3f, 4>& corners, Imath::V2f uv_low, Imath::V2f uv_high);
    /// Axis-aligned, then moved by `place`.
    void add_box(Imath::V3f low, Imath::V3f high, float repeat, const Imath::M44f& place = {});
    /// From a to b, possibly a cone's part, with caps where `capped`.
    void add_cylinder(Imath::V3f a, Imath::V3f b, float radius_a, float radius_b, int sides, float repeat,
                      bool capped = true);
    /// `repeats` of the texture around the equator, half as many from pole to pole.
    void add_sphere(Imath::V3f center, float radius, int sides, float repeats);
    /// Around the y axis.
    void add_torus(Imath::V3f center, float ring_radius, float tube_radius, int ring_sides, int tube_sides,
                   Imath::V2f repeats);

  private:
    uint32_t add_vertex(Imath::V3f position, Imath::V3f normal, Imath::V2f uv);
    void add_grid_triangles(uint32_t first, int columns, int rows);
};

/// A thing of several materials. A deque, so that references to its meshes last while others are added.
using Model = std::deque<Mesh>;

/// The mesh of `model` that has this material, a new one where there is none.
Mesh& mesh_of(Model& model, int material);

void append(Model& model, const Model& other, const Imath::M44f& place = {});

}  // namespace clarus::render
