#include <assimp/material.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cmath>
#include <cstring>

#include "base/error.h"
#include "render/worlds/model_file.h"

namespace clarus::render {
namespace {

using Imath::V3f;

V3f color_of(const aiColor3D& c) { return {c.r, c.g, c.b}; }

/// Colours of formats older than glTF are display values.
V3f linear(const V3f& c) {
    const auto decode = [](float x) { return std::pow(std::max(x, 0.0f), 2.2f); };
    return {decode(c.x), decode(c.y), decode(c.z)};
}

/// The bytes of a texture that the model holds; the few that hold bare texels are not supported.
std::shared_ptr<const std::vector<uint8_t>> bytes_of(const aiTexture& texture) {
    if (texture.mHeight != 0) return nullptr;
    const auto* begin = reinterpret_cast<const uint8_t*>(texture.pcData);
    return std::make_shared<std::vector<uint8_t>>(begin, begin + texture.mWidth);
}

Look look_of(const aiScene& scene, const aiMaterial& material) {
    Look look;
    aiColor4D base;
    aiColor3D color;
    const bool physical = material.Get(AI_MATKEY_BASE_COLOR, base) == AI_SUCCESS;
    if (physical) {
        look.color = {base.r, base.g, base.b};
        look.opacity = base.a;
    } else if (material.Get(AI_MATKEY_COLOR_DIFFUSE, color) == AI_SUCCESS) {
        look.color = linear(color_of(color));
    }
    if (!physical) material.Get(AI_MATKEY_OPACITY, look.opacity);
    if (material.Get(AI_MATKEY_COLOR_EMISSIVE, color) == AI_SUCCESS) look.emission = color_of(color);
    float shininess = 0, roughness = 1;
    if (material.Get(AI_MATKEY_SHININESS, shininess) == AI_SUCCESS && shininess > 1 &&
        material.Get(AI_MATKEY_COLOR_SPECULAR, color) == AI_SUCCESS) {
        look.highlight = std::max({color.r, color.g, color.b});
        look.sharpness = std::log2(shininess);
    } else if (material.Get(AI_MATKEY_ROUGHNESS_FACTOR, roughness) == AI_SUCCESS && roughness < 0.9f) {
        look.highlight = 1 - roughness;
        look.sharpness = 9 - 7 * roughness;
    }
    for (const aiTextureType type : {aiTextureType_BASE_COLOR, aiTextureType_DIFFUSE, aiTextureType_EMISSIVE}) {
        aiString name;
        if (material.GetTexture(type, 0, &name) != AI_SUCCESS) continue;
        look.texture = name.C_Str();
        if (const aiTexture* embedded = scene.GetEmbeddedTexture(name.C_Str())) look.embedded = bytes_of(*embedded);
        // Wavefront files often say black where a texture says it all.
        if (!physical && look.color.length2() == 0) look.color = V3f(1);
        break;
    }
    return look;
}

Piece piece_of(const aiScene& scene, const aiMesh& mesh) {
    Piece piece;
    piece.name = mesh.mName.C_Str();
    piece.look = look_of(scene, *scene.mMaterials[mesh.mMaterialIndex]);
    for (unsigned i = 0; i < mesh.mNumVertices; ++i) {
        const aiVector3D &p = mesh.mVertices[i], &n = mesh.mNormals[i];
        piece.mesh.positions.emplace_back(p.x, p.y, p.z);
        piece.mesh.normals.emplace_back(n.x, n.y, n.z);
        const bool textured = mesh.HasTextureCoords(0);
        piece.mesh.uvs.emplace_back(textured ? mesh.mTextureCoords[0][i].x : 0,
                                    textured ? mesh.mTextureCoords[0][i].y : 0);
    }
    for (unsigned i = 0; i < mesh.mNumFaces; ++i) {
        const aiFace& face = mesh.mFaces[i];
        piece.mesh.triangles.push_back({face.mIndices[0], face.mIndices[1], face.mIndices[2]});
    }
    return piece;
}

}  // namespace

std::vector<Piece> read_with_assimp(const std::filesystem::path& path) {
    Assimp::Importer importer;
    importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE, aiPrimitiveType_POINT | aiPrimitiveType_LINE);
    importer.SetPropertyFloat(AI_CONFIG_PP_GSN_MAX_SMOOTHING_ANGLE, 50);
    const aiScene* scene = importer.ReadFile(
        path.string(), aiProcess_Triangulate | aiProcess_SortByPType | aiProcess_GenSmoothNormals |
                           aiProcess_PreTransformVertices | aiProcess_FlipUVs | aiProcess_JoinIdenticalVertices);
    if (!scene) fail(ErrorKind::file, "cannot read the model {}: {}", path.string(), importer.GetErrorString());
    std::vector<Piece> pieces;
    for (unsigned i = 0; i < scene->mNumMeshes; ++i) pieces.push_back(piece_of(*scene, *scene->mMeshes[i]));
    return pieces;
}

}  // namespace clarus::render
