#include "render/worlds/furniture.h"

#include <unzip.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdlib>
#include <iterator>
#include <map>
#include <memory>
#include <span>
#include <sstream>

#include "base/error.h"
#include "io/file.h"
#include "io/temporary_folder.h"

// sweethome3d-furniture: the catalogues BlendSwap-CC-0 (CC-0), BlendSwap-CC-BY (CC-BY 3.0, the Blend Swap
// contributors), KatorLegaz (CC-BY 3.0 US, Andrew Kator & Jennifer Legaz) and Scopia (CC-BY 3.0, Scopia Visual
// Interfaces Systems). Reallusion's, which has people only, is left out.

namespace clarus::render {
namespace {

namespace fs = std::filesystem;
using Imath::M44f;
using Imath::V3f;

const fs::path folder = "/usr/share/sweethome3d/furniture";
constexpr std::array archives = {"BlendSwap-CC-0.sh3f", "BlendSwap-CC-BY.sh3f", "KatorLegaz.sh3f", "Scopia.sh3f"};
// Bytes of a model's file, about 7000 triangles, and of that with its textures.
constexpr unsigned long heaviest_model = 700'000, heaviest_folder = 1'200'000;

class Zip {
  public:
    explicit Zip(const fs::path& path) : path_(path), file_(unzOpen64(path.c_str()), &unzClose) {
        if (!file_) fail(ErrorKind::file, "cannot read the archive {}", path.string());
    }

    struct Entry {
        std::string name;
        unsigned long bytes;
    };
    std::vector<Entry> entries() {
        std::vector<Entry> all;
        for (int found = unzGoToFirstFile(file_.get()); found == UNZ_OK; found = unzGoToNextFile(file_.get())) {
            unz_file_info info;
            std::array<char, 512> name{};
            if (unzGetCurrentFileInfo(file_.get(), &info, name.data(), name.size() - 1, nullptr, 0, nullptr, 0) !=
                UNZ_OK)
                break;
            all.push_back({name.data(), info.uncompressed_size});
        }
        return all;
    }

    std::string read(const Entry& entry) {
        std::string bytes(entry.bytes, '\0');
        const bool whole = unzLocateFile(file_.get(), entry.name.c_str(), 1) == UNZ_OK &&
                           unzOpenCurrentFile(file_.get()) == UNZ_OK &&
                           unzReadCurrentFile(file_.get(), bytes.data(), static_cast<unsigned>(bytes.size())) ==
                               static_cast<int>(bytes.size()) &&
                           unzCloseCurrentFile(file_.get()) == UNZ_OK;
        if (!whole) fail(ErrorKind::file, "cannot read {} in the archive {}", entry.name, path_.string());
        return bytes;
    }

  private:
    fs::path path_;
    std::unique_ptr<void, decltype(&unzClose)> file_;
};

/// With a slash at its end.
std::string folder_of(const std::string& entry) { return fs::path(entry).parent_path().string() + "/"; }

/// Lines of key#number=value, by number.
std::map<int, std::map<std::string, std::string>> parse_properties(const std::string& text) {
    std::map<int, std::map<std::string, std::string>> pieces;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
        while (!line.empty() && line.back() == '\r') line.pop_back();
        const size_t hash = line.find('#'), equals = line.find('=');
        int number = 0;
        if (hash == 0 || hash == std::string::npos || equals == std::string::npos || equals < hash) continue;
        const auto [end, error] = std::from_chars(&line[hash] + 1, &line[equals], number);
        if (error == std::errc()) pieces[number][line.substr(0, hash)] = line.substr(equals + 1);
    }
    return pieces;
}

/// Of a number of centimetres; 0 where there is none.
float metres(const std::string& text) { return std::strtof(text.c_str(), nullptr) / 100; }

/// Nine numbers, row by row, for column vectors.
M44f rotation_of(const std::string& text) {
    M44f rotation;
    std::istringstream numbers(text);
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) {
            float value = row == column ? 1 : 0;
            if (!text.empty()) numbers >> value;
            rotation[column][row] = value;
        }
    }
    return rotation;
}

}  // namespace

std::vector<Furniture> read_furniture(const fs::path& archive) {
    Zip zip(archive);
    std::map<std::string, unsigned long> bytes;
    for (const Zip::Entry& entry : zip.entries()) {
        bytes[entry.name] = entry.bytes;
        bytes[folder_of(entry.name)] += entry.bytes;
    }
    const std::string catalogue = "PluginFurnitureCatalog.properties";
    std::vector<Furniture> all;
    for (auto& [number, piece] : parse_properties(zip.read({catalogue, bytes[catalogue]}))) {
        const std::string model = piece["model"].empty() ? "" : piece["model"].substr(1);
        const auto size = bytes.find(model);
        if (size == bytes.end() || size->second > heaviest_model || bytes[folder_of(model)] > heaviest_folder ||
            piece["doorOrWindow"] == "true") {
            continue;
        }
        const V3f extent(metres(piece["width"]), metres(piece["height"]), metres(piece["depth"]));
        if (extent.x <= 0 || extent.y <= 0 || extent.z <= 0) continue;
        all.push_back({archive, model, piece["name"], piece["category"], extent, metres(piece["elevation"]),
                       std::max(0.0f, metres(piece["dropOnTopElevation"])), rotation_of(piece["modelRotation"])});
    }
    return all;
}

std::vector<Furniture> read_installed_furniture() {
    std::vector<Furniture> all;
    for (const char* name : archives) {
        const fs::path path = folder / name;
        if (!fs::exists(path)) {
            fail(ErrorKind::file, "there is no {}; it comes with: apt-get install sweethome3d-furniture",
                 path.string());
        }
        std::ranges::move(read_furniture(path), std::back_inserter(all));
    }
    return all;
}

Model load_furniture(Importer& importer, const Furniture& piece) {
    const io::TemporaryFolder unpacked;
    const std::string place = folder_of(piece.model);
    Zip zip(piece.archive);
    for (const Zip::Entry& entry : zip.entries()) {
        if (!entry.name.starts_with(place) || entry.name.ends_with("/")) continue;
        const fs::path file = unpacked.path() / fs::path(entry.name).filename();
        const std::string bytes = zip.read(entry);
        io::write_file_atomically(file, std::as_bytes(std::span(bytes)));
    }
    Model rotated, placed;
    append(rotated, importer.load(unpacked.path() / fs::path(piece.model).filename()), piece.rotation);
    const Bounds box = bounds(rotated);
    M44f to_origin, to_size;
    to_origin.setTranslation(-V3f(box.center().x, box.low.y, box.center().z));
    V3f scale;
    for (int i = 0; i < 3; ++i) scale[i] = piece.size[i] / std::max(box.size()[i], 1e-6f);
    to_size.setScale(scale);
    append(placed, rotated, to_origin * to_size);
    return placed;
}

}  // namespace clarus::render
