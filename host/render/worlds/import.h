#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "render/scene.h"
#include "render/worlds/model_file.h"

namespace clarus::render {

/// Brings model files into a scene: a look that several share becomes one material, a texture is loaded once. Textures
/// with holes are cut out, translucent ones and faint materials are blended. One that cannot be found is logged as a
/// warning, and its surfaces have their plain colour.
class Importer {
  public:
    /// Textures are sought beside the model, below it, and in these folders, whatever the case of their names.
    explicit Importer(Scene& scene, std::vector<std::filesystem::path> texture_folders = {});

    /// In the file's coordinates. Errors: file where it cannot be read or holds no triangles.
    Model load(const std::filesystem::path& file);
    /// The same of pieces that are read; their textures are sought from `folder` on.
    Model load(const std::vector<Piece>& pieces, const std::filesystem::path& folder);

  private:
    int material_of(const Look& look, const std::filesystem::path& folder);
    std::shared_ptr<const Texture> texture_of(const Look& look, const std::filesystem::path& folder);
    std::filesystem::path find(const std::string& name, const std::filesystem::path& folder);
    /// Files below a folder by their names in lower case.
    const std::map<std::string, std::filesystem::path>& files_below(const std::filesystem::path& folder);

    Scene& scene_;
    std::vector<std::filesystem::path> texture_folders_;
    std::map<std::filesystem::path, std::map<std::string, std::filesystem::path>> files_;
    std::map<std::filesystem::path, std::shared_ptr<const Texture>> textures_;
    std::map<std::string, int> materials_;
    std::set<std::string> missing_;
    std::shared_ptr<const Texture> plain_;
};

/// The pieces of any model file.
std::vector<Piece> read_model(const std::filesystem::path& file);

/// The box around a model. An empty one for no vertices.
struct Bounds {
    Imath::V3f low{0}, high{0};
    Imath::V3f center() const { return (low + high) / 2; }
    Imath::V3f size() const { return high - low; }
};
Bounds bounds(const Model& model);

}  // namespace clarus::render
