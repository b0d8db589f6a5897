#include "render/scene.h"

#include <tbb/task_arena.h>

#include <new>

#include "base/error.h"
#include "render/ambient.h"

namespace clarus::render {
namespace {

using Imath::V2f;
using Imath::V3f;

/// How u and v change with a step in the triangle's plane.
std::array<V3f, 2> uv_gradient(const Mesh& mesh, const std::array<uint32_t, 3>& triangle) {
    const auto [a, b, c] = triangle;
    const V3f e1 = mesh.positions[b] - mesh.positions[a], e2 = mesh.positions[c] - mesh.positions[a];
    const V2f d1 = mesh.uvs[b] - mesh.uvs[a], d2 = mesh.uvs[c] - mesh.uvs[a];
    const float e11 = e1 ^ e1, e12 = e1 ^ e2, e22 = e2 ^ e2, determinant = e11 * e22 - e12 * e12;
    if (determinant <= 0) return {V3f(0), V3f(0)};
    // The dual basis: dual1 · e1 = 1, dual1 · e2 = 0, and likewise.
    const V3f dual1 = (e1 * e22 - e2 * e12) / determinant, dual2 = (e2 * e11 - e1 * e12) / determinant;
    return {dual1 * d1.x + dual2 * d2.x, dual1 * d1.y + dual2 * d2.y};
}

std::vector<std::array<V3f, 2>> uv_gradients(const Mesh& mesh) {
    std::vector<std::array<V3f, 2>> gradients;
    for (const auto& triangle : mesh.triangles) gradients.push_back(uv_gradient(mesh, triangle));
    return gradients;
}

/// Of the vertices: the means of their triangles', larger ones more.
void set_smooth_normals(Mesh& mesh) {
    mesh.normals.assign(mesh.positions.size(), V3f(0));
    for (const auto& [a, b, c] : mesh.triangles) {
        const V3f& corner = mesh.positions[a];
        const V3f normal = (mesh.positions[b] - corner) % (mesh.positions[c] - corner);
        for (const uint32_t vertex : {a, b, c}) mesh.normals[vertex] += normal;
    }
    for (V3f& normal : mesh.normals) normal.normalize();
}

void share_buffer(RTCGeometry geometry, RTCBufferType type, RTCFormat format, const void* data, size_t stride,
                  size_t count) {
    rtcSetSharedGeometryBuffer(geometry, type, 0, format, data, 0, stride, count);
}

/// With several threads the order of triangles, and so which of two equally near ones is hit, could vary.
void commit_on_one_thread(RTCScene scene) {
    tbb::task_arena(1).execute([scene] { rtcJoinCommitScene(scene); });
}

}  // namespace

Scene::Scene() : device_(rtcNewDevice(nullptr)) {
    if (!device_)
        fail(ErrorKind::device, "Embree cannot start (error {})", static_cast<int>(rtcGetDeviceError(nullptr)));
    parts_.push_back(std::make_unique<Part>());
}

Scene::~Scene() {
    for (const auto& part : parts_) {
        for (const EmbreeInstance& embree : {part->solid, part->blended}) {
            if (embree.instance) rtcReleaseGeometry(embree.instance);
            if (embree.scene) rtcReleaseScene(embree.scene);
        }
    }
    for (const RTCScene root : {solid_root_, blended_root_})
        if (root) rtcReleaseScene(root);
    rtcReleaseDevice(device_);
}

int Scene::add_material(Material material) {
    materials_.push_back(std::move(material));
    return static_cast<int>(materials_.size()) - 1;
}

void Scene::add_static(const Model& model) { append(parts_.front()->model, model); }

void Scene::add_moving(Model model, Motion motion) {
    auto part = std::make_unique<Part>();
    part->model = std::move(model);
    part->motion = std::move(motion);
    parts_.push_back(std::move(part));
}

void Scene::add_deforming(Mesh mesh, Deformation deformation) {
    auto part = std::make_unique<Part>();
    deformation(0, mesh.positions);
    set_smooth_normals(mesh);
    part->previous_positions = mesh.positions;
    part->model.push_back(std::move(mesh));
    part->deformation = std::move(deformation);
    parts_.push_back(std::move(part));
}

void Scene::build() {
    solid_root_ = rtcNewScene(device_);
    size_t vertices = 0;
    for (unsigned index = 0; index < parts_.size(); ++index) {
        build_part(index);
        for (const Mesh& mesh : parts_[index]->model) vertices += mesh.positions.size();
    }
    if (rtcGetDeviceError(device_) == RTC_ERROR_OUT_OF_MEMORY) throw std::bad_alloc();
    for (const auto& part : parts_) part->openness = bake_openness(part->solid.scene, part->model, vertices);
    set_time(0, 0);
}

void Scene::build_part(unsigned index) {
    Part& part = *parts_[index];
    part.solid.scene = rtcNewScene(device_);
    for (unsigned i = 0; i < part.model.size(); ++i) {
        Mesh& mesh = part.model[i];
        // Embree reads 16 bytes at a time: three floats at the end of the buffer need one to spare.
        mesh.positions.reserve(mesh.positions.size() + 1);
        add_geometry(material(mesh.material).blended ? part.blended : part.solid, part, i);
        part.uv_gradients.push_back(uv_gradients(mesh));
    }
    instantiate(part.solid, solid_root_, index);
    if (!part.blended.scene) return;
    if (!blended_root_) blended_root_ = rtcNewScene(device_);
    instantiate(part.blended, blended_root_, index);
}

void Scene::add_geometry(EmbreeInstance& instance, Part& part, unsigned index) {
    const Mesh& mesh = part.model[index];
    RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    share_buffer(geometry, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, mesh.positions.data(), sizeof(V3f),
                 mesh.positions.size());
    share_buffer(geometry, RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3, mesh.triangles.data(), 3 * sizeof(uint32_t),
                 mesh.triangles.size());
    const Material& surface = material(mesh.material);
    if (surface.cutout) {
        cutouts_.push_back(std::make_unique<Cutout>(Cutout{&mesh, surface.texture.get()}));
        rtcSetGeometryUserData(geometry, cutouts_.back().get());
        rtcSetGeometryIntersectFilterFunction(geometry, discard_holes);
        rtcSetGeometryOccludedFilterFunction(geometry, discard_holes);
    }
    rtcCommitGeometry(geometry);
    if (!instance.scene) instance.scene = rtcNewScene(device_);
    rtcAttachGeometryByID(instance.scene, geometry, index);
    rtcReleaseGeometry(geometry);
}

void Scene::instantiate(EmbreeInstance& instance, RTCScene& root, unsigned part) {
    commit_on_one_thread(instance.scene);
    instance.instance = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_INSTANCE);
    rtcSetGeometryInstancedScene(instance.instance, instance.scene);
    rtcAttachGeometryByID(root, instance.instance, part);
}

void Scene::deform(Part& part, double seconds, double previous_seconds) {
    Mesh& mesh = part.model.front();
    part.deformation(seconds, mesh.positions);
    part.deformation(previous_seconds, part.previous_positions);
    set_smooth_normals(mesh);
    part.uv_gradients.front() = uv_gradients(mesh);
    RTCGeometry geometry = rtcGetGeometry(part.solid.scene, 0);
    rtcUpdateGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0);
    rtcCommitGeometry(geometry);
    commit_on_one_thread(part.solid.scene);
}

void Scene::set_time(double seconds, double previous_seconds) {
    for (const auto& part : parts_) {
        if (part->deformation) deform(*part, seconds, previous_seconds);
        const Imath::M44d now = part->motion ? part->motion(seconds) : Imath::M44d();
        const Imath::M44d before = part->motion ? part->motion(previous_seconds) : Imath::M44d();
        part->to_object = now.inverse();
        part->to_previous = part->to_object * before;
        for (int row = 0; row < 3; ++row) {
            for (int column = 0; column < 3; ++column)
                part->rotation[row][column] = static_cast<float>(now[row][column]);
        }
        // Imath's rows for row vectors are Embree's columns for column vectors.
        const Imath::M44f single(now);
        for (const EmbreeInstance& embree : {part->solid, part->blended}) {
            if (!embree.instance) continue;
            rtcSetGeometryTransform(embree.instance, 0, RTC_FORMAT_FLOAT4X4_COLUMN_MAJOR, &single[0][0]);
            rtcCommitGeometry(embree.instance);
        }
    }
    for (const RTCScene root : {solid_root_, blended_root_})
        if (root) commit_on_one_thread(root);
}

void Scene::discard_holes(const RTCFilterFunctionNArguments* hits) {
    const Cutout& cutout = *static_cast<const Cutout*>(hits->geometryUserPtr);
    for (unsigned lane = 0; lane < hits->N; ++lane) {
        if (!hits->valid[lane]) continue;
        const auto [a, b, c] = cutout.mesh->triangles[RTCHitN_primID(hits->hit, hits->N, lane)];
        const float u = RTCHitN_u(hits->hit, hits->N, lane), v = RTCHitN_v(hits->hit, hits->N, lane);
        const std::vector<V2f>& uvs = cutout.mesh->uvs;
        if (cutout.texture->alpha(uvs[a] * (1 - u - v) + uvs[b] * u + uvs[c] * v) < 0.5f) hits->valid[lane] = 0;
    }
}

}  // namespace clarus::render
