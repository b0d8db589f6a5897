#pragma once

#include <Imath/ImathMatrix.h>
#include <embree3/rtcore.h>

#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "render/mesh.h"
#include "render/texture.h"

namespace clarus::render {

struct Material {
    std::shared_ptr<const Texture> texture;
    Imath::V3f tint{1};
    float highlight = 0;  // strength of the sun's highlight
    int sharpness = 5;    // the highlight's exponent is 2^sharpness
    float mirror = 0;     // share of the sky that is mirrored looking straight on (Schlick)
    bool cutout = false;  // nothing where the texture's alpha is below ½; lit from both sides, as leaves are
    float emission = 0;   // of its own light, in its own colour
    // Glass, smoke, sparks: laid over what is behind by the texture's alpha times `opacity`, after everything opaque,
    // as engines do. Depth and motion are those of what is behind.
    bool blended = false;
    float opacity = 1;
};

/// A user interface's colour (display-encoded) and alpha at a place in [0, 1)² of the image. It is blended in linear
/// light, where its white has the radiance 1.
using Overlay = std::function<Rgba(Imath::V2f place)>;

/// Light from far away. Radiance where a white surface in full sun is about 1.
struct Environment {
    Imath::V3f to_sun{0, 1, 0};  // unit
    Imath::V3f sun{0}, zenith{0}, horizon{0}, ground{0};
    std::shared_ptr<const Texture> clouds;
    float haze = 0;  // share of light lost a metre
};

/// What is drawn: a static part, rigid moving parts, and meshes that change their shape. Add everything, `build` once,
/// then `set_time` a frame. The same additions give the same pictures, bit by bit.
class Scene {
  public:
    struct EmbreeInstance {
        RTCScene scene = nullptr;
        RTCGeometry instance = nullptr;
    };

    /// From the object's space to the world: rotation and translation, for row vectors (p · M).
    using Motion = std::function<Imath::M44d(double seconds)>;

    /// Puts a mesh's vertices where they are at a time, in world space, in the mesh's order.
    using Deformation = std::function<void(double seconds, std::span<Imath::V3f> positions)>;

    /// A part of the scene that moves as one, with what shading needs of it at the time that is set.
    struct Part {
        /// Meshes by Embree's geometry id.
        Model model;
        /// Of u and v, a triangle each.
        std::vector<std::vector<std::array<Imath::V3f, 2>>> uv_gradients;
        /// A vertex each, 0…1: what the part itself leaves of the sky's light (ambient.h).
        std::vector<std::vector<float>> openness;
        /// Empty: static, in world space.
        Motion motion;
        /// Empty: the part keeps its shape. Otherwise it is one mesh in world space without `motion`, whose positions,
        /// normals and gradients are those of the time set, and these the positions at the previous time.
        Deformation deformation;
        std::vector<Imath::V3f> previous_positions;
        /// Of vectors, object to world.
        Imath::M33f rotation;
        /// Of world points at the time set: to the object's space, and to where they were at the previous time.
        Imath::M44d to_object, to_previous;

        /// Of what is opaque or cut out, and of what is blended; the latter null where nothing is.
        EmbreeInstance solid, blended;
    };

    Scene();
    ~Scene();
    Scene(const Scene&) = delete;
    Scene& operator=(const Scene&) = delete;

    int add_material(Material material);
    void add_static(const Model& model);
    void add_moving(Model model, Motion motion);
    /// Opaque or cut out. The mesh's own positions do not count; its normals become the means of its triangles'.
    void add_deforming(Mesh mesh, Deformation deformation);

    void build();
    void set_time(double seconds, double previous_seconds);

    /// Of everything that is opaque or cut out: what depth, motion and shadows come from.
    RTCScene embree() const { return solid_root_; }
    /// Of what is blended over it; null where nothing is.
    RTCScene embree_blended() const { return blended_root_; }
    const Part& part(unsigned instance) const { return *parts_[instance]; }
    const Material& material(int index) const { return materials_[static_cast<size_t>(index)]; }

    Environment environment;
    Overlay overlay;  // over everything, without depth or motion; may be empty

  private:
    void build_part(unsigned index);
    void add_geometry(EmbreeInstance& instance, Part& part, unsigned mesh);
    void instantiate(EmbreeInstance& instance, RTCScene& root, unsigned part);
    static void deform(Part& part, double seconds, double previous_seconds);

    std::vector<Material> materials_;
    std::vector<std::unique_ptr<Part>> parts_;  // by Embree's instance id; the first is static
    // What the alpha test of a cut-out mesh looks at.
    struct Cutout {
        const Mesh* mesh;
        const Texture* texture;
    };
    static void discard_holes(const RTCFilterFunctionNArguments* hits);
    std::vector<std::unique_ptr<Cutout>> cutouts_;
    RTCDevice device_;
    RTCScene solid_root_ = nullptr, blended_root_ = nullptr;
};

}  // namespace clarus::render
