#include "render/worlds/import.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <string_view>

#include "base/error.h"
#include "base/log.h"
#include "base/lower_case.h"
#include "io/file.h"
#include "io/temporary_folder.h"
#include "render/worlds/seed.h"

namespace clarus::render {
namespace {

namespace fs = std::filesystem;
using Imath::V2f;
using Imath::V3f;

/// Shares of a texture's texels, on a grid.
struct Holes {
    float clear = 0, faint = 0;  // alpha below 0.1; from there to 0.9
};

Holes holes_of(const Texture& texture) {
    constexpr int grid = 96;
    Holes holes;
    if (texture.opaque()) return holes;
    for (int y = 0; y < grid; ++y) {
        for (int x = 0; x < grid; ++x) {
            const float alpha = texture.alpha(V2f(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f) / grid);
            if (alpha < 0.1f) holes.clear += 1.0f / (grid * grid);
            if (alpha >= 0.1f && alpha < 0.9f) holes.faint += 1.0f / (grid * grid);
        }
    }
    return holes;
}

/// Moves a mesh's uvs by whole repeats of the texture, so that far ones keep their precision.
void settle_uvs(Mesh& mesh) {
    if (mesh.uvs.empty()) return;
    V2f low = mesh.uvs.front();
    for (const V2f& uv : mesh.uvs) low = {std::min(low.x, uv.x), std::min(low.y, uv.y)};
    const V2f whole(std::floor(low.x), std::floor(low.y));
    for (V2f& uv : mesh.uvs) uv -= whole;
}

bool finite(const V3f& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

}  // namespace

Importer::Importer(Scene& scene, std::vector<fs::path> texture_folders)
    : scene_(scene),
      texture_folders_(std::move(texture_folders)),
      plain_(std::make_shared<Texture>(0, [](float, float) {
          return Rgba{1, 1, 1, 1};
      })) {}

std::vector<Piece> read_model(const fs::path& file) {
    if (!fs::is_regular_file(file)) fail(ErrorKind::file, "there is no model file {}", file.string());
    const std::string kind = lower_case(file.extension().string());
    return kind == ".ac" || kind == ".acc" ? read_ac3d(file) : read_with_assimp(file);
}

Model Importer::load(const fs::path& file) {
    Model model = load(read_model(file), file.parent_path());
    if (model.empty()) fail(ErrorKind::file, "the model {} has no triangles", file.string());
    return model;
}

Model Importer::load(const std::vector<Piece>& pieces, const fs::path& folder) {
    Model model;
    for (const Piece& piece : pieces) {
        if (piece.mesh.triangles.empty()) continue;
        if (!std::ranges::all_of(piece.mesh.positions, finite)) {
            fail(ErrorKind::file, "\"{}\" of a model in {} has a vertex that is not finite", piece.name,
                 folder.string());
        }
        Mesh mesh = piece.mesh;
        settle_uvs(mesh);
        mesh_of(model, material_of(piece.look, folder)).append(mesh);
    }
    return model;
}

int Importer::material_of(const Look& look, const fs::path& folder) {
    const std::string_view held =
        look.embedded ? std::string_view(reinterpret_cast<const char*>(look.embedded->data()), look.embedded->size())
                      : "";
    const std::string key =
        fmt::format("{} {} {} {} {} {} {} {} {} {} {} {}", look.texture, seed_of(held, held.size()),
                    look.texture.empty() ? "" : folder.string(), look.color.x, look.color.y, look.color.z,
                    look.emission.x, look.emission.y, look.emission.z, look.opacity, look.highlight, look.sharpness);
    const auto known = materials_.find(key);
    if (known != materials_.end()) return known->second;

    Material material;
    material.texture = texture_of(look, folder);
    material.tint = look.color;
    material.highlight = 0.5f * std::min(look.highlight, 1.0f);
    material.sharpness = std::clamp(static_cast<int>(std::lround(look.sharpness)), 2, 10);
    material.mirror = material.sharpness >= 7 ? 0.05f * std::min(look.highlight, 1.0f) : 0;
    const float glow = std::max({look.emission.x, look.emission.y, look.emission.z});
    if (glow > 0.05f) {
        const float own = std::max({look.color.x, look.color.y, look.color.z});
        if (own < glow) material.tint = look.emission / glow;
        material.emission = glow / std::max(own, glow);
    }
    const Holes holes = holes_of(*material.texture);
    material.opacity = look.opacity;
    material.blended = look.opacity < 0.95f || holes.faint > 0.5f;
    material.cutout = !material.blended && holes.clear + holes.faint > 0.002f;
    return materials_[key] = scene_.add_material(material);
}

std::shared_ptr<const Texture> Importer::texture_of(const Look& look, const fs::path& folder) {
    if (look.texture.empty()) return plain_;
    try {
        if (look.embedded) {
            const io::TemporaryFolder folder_of_it;
            const fs::path file = folder_of_it.path() / "texture";
            io::write_file_atomically(file, std::as_bytes(std::span(*look.embedded)));
            return Texture::load(file);
        }
        const fs::path file = find(look.texture, folder);
        if (!file.empty()) {
            auto& texture = textures_[file];
            if (!texture) texture = Texture::load(file);
            return texture;
        }
        if (missing_.insert(look.texture).second) {
            log(LogLevel::warning, "the texture {} of a model in {} is not there; its surfaces have a plain colour",
                look.texture, folder.string());
        }
    } catch (const Error& error) {
        if (missing_.insert(look.texture).second) log(LogLevel::warning, "{}; the plain colour instead", error.what());
    }
    return plain_;
}

fs::path Importer::find(const std::string& name, const fs::path& folder) {
    std::string slashed = name.substr(0, name.find_last_not_of(" \t\r") + 1);
    std::ranges::replace(slashed, '\\', '/');
    std::error_code ignored;
    if (fs::is_regular_file(folder / slashed, ignored)) return folder / slashed;
    const std::string wanted = lower_case(fs::path(slashed).filename().string());
    const auto found_in = [&](const fs::path& place) {
        const auto& files = files_below(place);
        const auto found = files.find(wanted);
        return found == files.end() ? fs::path() : found->second;
    };
    fs::path found = found_in(folder);
    for (const fs::path& other : texture_folders_) {
        if (found.empty()) found = found_in(other);
    }
    return found;
}

const std::map<std::string, fs::path>& Importer::files_below(const fs::path& folder) {
    const auto known = files_.find(folder);
    if (known != files_.end()) return known->second;
    auto& files = files_[folder];
    std::error_code error;
    constexpr int deepest = 2;
    for (auto entry = fs::recursive_directory_iterator(folder, fs::directory_options::skip_permission_denied, error);
         !error && entry != fs::recursive_directory_iterator(); entry.increment(error)) {
        if (entry.depth() >= deepest) entry.disable_recursion_pending();
        if (!entry->is_regular_file(error)) continue;
        // Of several with one name the first in the alphabet, since folders have no order.
        fs::path& file = files[lower_case(entry->path().filename().string())];
        if (file.empty() || entry->path() < file) file = entry->path();
    }
    return files;
}

Bounds bounds(const Model& model) {
    Bounds box{V3f(std::numeric_limits<float>::max()), V3f(std::numeric_limits<float>::lowest())};
    for (const Mesh& mesh : model) {
        for (const V3f& p : mesh.positions) {
            for (int i = 0; i < 3; ++i) {
                box.low[i] = std::min(box.low[i], p[i]);
                box.high[i] = std::max(box.high[i], p[i]);
            }
        }
    }
    return box.low.x > box.high.x ? Bounds{} : box;
}

}  // namespace clarus::render
