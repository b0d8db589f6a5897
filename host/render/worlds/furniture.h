#pragma once

#include <Imath/ImathMatrix.h>

#include <filesystem>
#include <string>
#include <vector>

#include "render/worlds/import.h"

namespace clarus::render {

/// A piece of a Sweet Home 3D catalogue, in metres.
struct Furniture {
    std::filesystem::path archive;
    std::string model;  // the file in the archive
    std::string name, category;
    Imath::V3f size;       // width, height, depth; its back is at −z
    float elevation = 0;   // above the floor
    float top = 0;         // height at which things can stand on it; 0: nowhere
    Imath::M44f rotation;  // of the model's file
};

/// What an archive (.sh3f) has that is light enough to be drawn often. Errors: file.
std::vector<Furniture> read_furniture(const std::filesystem::path& archive);
/// All that Debian's sweethome3d-furniture has. Errors: file where it is missing.
std::vector<Furniture> read_installed_furniture();

/// On the floor at the origin, in its size. Errors: file.
Model load_furniture(Importer& importer, const Furniture& piece);

}  // namespace clarus::render
