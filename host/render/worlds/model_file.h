#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "render/mesh.h"

namespace clarus::render {

/// How a part of a model looks, as its file says it. Colours are linear.
struct Look {
    std::string texture;                                   // a file's name as it stands there; empty: none
    std::shared_ptr<const std::vector<uint8_t>> embedded;  // the texture's file, where the model holds it itself
    Imath::V3f color{1};                                   // multiplied with the texture
    Imath::V3f emission{0};
    float opacity = 1;
    float highlight = 0, sharpness = 5;  // as Material's
};

/// A part of a model in the file's coordinates; y is up. v runs down the texture.
struct Piece {
    std::string name;
    Look look;
    Mesh mesh;  // its material is not set
};

/// AC3D (.ac), and TORCS' dialect of it (.acc), which has triangle strips, normals, and up to four textures a surface,
/// of which the first counts. Errors: file, naming the line.
std::vector<Piece> read_ac3d(const std::filesystem::path& path);

/// Everything that assimp reads. Errors: file, with assimp's words.
std::vector<Piece> read_with_assimp(const std::filesystem::path& path);

}  // namespace clarus::render
