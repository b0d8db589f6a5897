#include <Imath/ImathMatrix.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "base/error.h"
#include "render/worlds/model_file.h"

namespace clarus::render {
namespace {

using Imath::M44f;
using Imath::V2f;
using Imath::V3f;

/// Facets that meet at less than this (its cosine) are shaded as one smooth surface.
constexpr float smooth_cosine = 0.6f;

float linear(float encoded) { return std::pow(std::max(encoded, 0.0f), 2.2f); }

struct Corner {
    uint32_t vertex;
    V2f uv;
};

struct Triangle {
    std::array<Corner, 3> corners;
    bool smooth;
    int material;
};

class Ac3dReader {
  public:
    explicit Ac3dReader(const std::filesystem::path& path) : path_(path), file_(path) {
        std::error_code error;
        bytes_ = std::filesystem::file_size(path, error);
        if (!file_ || error) fail(ErrorKind::file, "cannot read {}", path.string());
    }

    std::vector<Piece> read() {
        if (next_word() != "AC3Db") wrong("does not start with AC3Db");
        std::string word;
        while (file_ >> word) {
            if (word == "MATERIAL") {
                read_material();
            } else if (word == "OBJECT") {
                read_object(M44f());
            } else {
                wrong("neither MATERIAL nor OBJECT");
            }
        }
        return std::move(pieces_);
    }

  private:
    [[noreturn]] void wrong(const char* what) {
        file_.clear();
        const auto position = static_cast<long long>(file_.tellg());
        fail(ErrorKind::file, "{} is not a whole AC3D file: near byte {}, {}", path_.string(), position, what);
    }

    template <typename T>
    T next() {
        T value{};
        if (!(file_ >> value)) wrong("a value is missing");
        return value;
    }
    std::string next_word() { return next<std::string>(); }
    V3f next_vector() {
        const float x = next<float>(), y = next<float>();
        return {x, y, next<float>()};
    }
    size_t next_count() {
        const int count = next<int>();
        if (count < 0 || static_cast<uintmax_t>(count) > bytes_) wrong("a count is negative or larger than the file");
        return static_cast<size_t>(count);
    }
    /// A word, or words in quotes.
    std::string next_string() {
        file_ >> std::ws;
        if (file_.peek() != '"') return next_word();
        file_.get();
        std::string text;
        if (!std::getline(file_, text, '"')) wrong("a quote is open");
        return text;
    }
    std::string rest_of_line() {
        std::string line;
        std::getline(file_, line);
        return line;
    }

    void read_material() {
        next_string();
        Look look;
        V3f color(1), glow(0);
        std::istringstream line(rest_of_line());
        for (std::string key; line >> key;) {
            V3f value(0);
            line >> value.x;
            if (key == "rgb" || key == "amb" || key == "emis" || key == "spec") line >> value.y >> value.z;
            if (!line) wrong("a material's value is missing");
            if (key == "rgb") color = value;
            if (key == "emis") glow = value;
            if (key == "spec") look.highlight = value.x;
            if (key == "shi") look.sharpness = std::log2(std::max(2.0f, value.x));
            if (key == "trans") look.opacity = 1 - value.x;
        }
        // Modellers write a share of the colour as emission, in place of light that the surroundings send.
        for (int i = 0; i < 3; ++i) look.color[i] = linear(std::min(1.0f, color[i] + glow[i]));
        materials_.push_back(look);
    }

    void read_object(const M44f& parent) {
        next_word();
        std::string name, texture;
        V2f repeat(1), offset(0);
        M44f place;
        std::vector<V3f> positions, normals;
        std::vector<Triangle> triangles;
        for (;;) {
            const std::string key = next_word();
            if (key == "name") {
                name = next_string();
            } else if (key == "data") {
                const size_t length = next_count();
                rest_of_line();
                file_.ignore(static_cast<std::streamsize>(length));
            } else if (key == "texture") {
                const std::string file = next_string();
                std::string layer;
                std::istringstream(rest_of_line()) >> layer;
                if ((layer.empty() || layer == "base") && file != "empty_texture_no_mapping" && file != "(null)") {
                    texture = file;
                }
            } else if (key == "texrep") {
                repeat.x = next<float>();
                repeat.y = next<float>();
            } else if (key == "texoff") {
                offset.x = next<float>();
                offset.y = next<float>();
            } else if (key == "rot") {
                for (int row = 0; row < 3; ++row) {
                    for (int column = 0; column < 3; ++column) place[row][column] = next<float>();
                }
            } else if (key == "loc") {
                const V3f to = next_vector();
                for (int i = 0; i < 3; ++i) place[3][i] = to[i];
            } else if (key == "numvert") {
                read_vertices(positions, normals);
            } else if (key == "numsurf") {
                for (size_t left = next_count(); left > 0; --left) read_surface(positions.size(), triangles);
            } else if (key == "kids") {
                break;
            } else {
                rest_of_line();  // url, crease, subdiv, …
            }
        }
        const M44f to_world = place * parent;
        add_pieces(name, texture, repeat, offset, to_world, positions, normals, triangles);
        // TORCS' tools count more children than they write.
        std::string word;
        for (size_t left = next_count(); left > 0 && file_ >> word; --left) {
            if (word != "OBJECT") wrong("an object's child is missing");
            read_object(to_world);
        }
    }

    void read_vertices(std::vector<V3f>& positions, std::vector<V3f>& normals) {
        const size_t count = next_count();
        rest_of_line();
        for (size_t i = 0; i < count; ++i) {
            std::istringstream line(rest_of_line());
            V3f position, normal;
            if (!(line >> position.x >> position.y >> position.z)) wrong("a vertex is missing");
            positions.push_back(position);
            if (line >> normal.x >> normal.y >> normal.z) normals.push_back(normal);
        }
        if (!normals.empty() && normals.size() != positions.size()) wrong("some vertices have a normal, others none");
    }

    void read_surface(size_t vertices, std::vector<Triangle>& triangles) {
        if (next_word() != "SURF") wrong("a surface is missing");
        const long flags = std::strtol(next_word().c_str(), nullptr, 0);
        int material = 0;
        std::string key = next_word();
        if (key == "mat") {
            material = next<int>();
            key = next_word();
        }
        if (key != "refs") wrong("a surface has no corners");
        std::vector<Corner> corners(next_count());
        rest_of_line();
        for (Corner& corner : corners) {
            std::istringstream line(rest_of_line());
            if (!(line >> corner.vertex >> corner.uv.x >> corner.uv.y)) wrong("a corner is missing");
            if (corner.vertex >= vertices) wrong("a corner's vertex is beyond the last one");
        }
        const long kind = flags & 15;
        const bool strip = kind == 4;
        if (kind != 0 && !strip) return;  // lines
        for (size_t i = 2; i < corners.size(); ++i) {
            const Corner &a = strip ? corners[i - 2] : corners[0], &b = corners[i - 1], &c = corners[i];
            if (a.vertex == b.vertex || b.vertex == c.vertex || c.vertex == a.vertex) continue;
            const bool swapped = strip && i % 2;
            triangles.push_back({{a, swapped ? c : b, swapped ? b : c}, (flags & 16) != 0, material});
        }
    }

    /// A piece for each material of the object.
    void add_pieces(const std::string& name, const std::string& texture, V2f repeat, V2f offset, const M44f& to_world,
                    const std::vector<V3f>& positions, const std::vector<V3f>& normals,
                    const std::vector<Triangle>& triangles) {
        std::vector<V3f> facets, smooth(positions.size(), V3f(0));
        for (const Triangle& triangle : triangles) {
            const auto& [a, b, c] = triangle.corners;
            facets.push_back((positions[b.vertex] - positions[a.vertex]) % (positions[c.vertex] - positions[a.vertex]));
            for (const Corner& corner : triangle.corners) smooth[corner.vertex] += facets.back();
        }
        std::vector<size_t> piece_of_material(materials_.size(), SIZE_MAX);
        for (size_t i = 0; i < triangles.size(); ++i) {
            const Triangle& triangle = triangles[i];
            if (triangle.material < 0 || triangle.material >= static_cast<int>(materials_.size())) {
                wrong("a surface's material is not there");
            }
            size_t& index = piece_of_material[static_cast<size_t>(triangle.material)];
            if (index == SIZE_MAX) {
                index = pieces_.size();
                Piece& piece = pieces_.emplace_back();
                piece.name = name;
                piece.look = materials_[static_cast<size_t>(triangle.material)];
                piece.look.texture = texture;
            }
            Mesh& mesh = pieces_[index].mesh;
            const V3f facet = facets[i].normalized();
            for (const Corner& corner : triangle.corners) {
                V3f normal = normals.empty() ? smooth[corner.vertex].normalized() : normals[corner.vertex];
                if (normals.empty() && (!triangle.smooth || (normal ^ facet) < smooth_cosine)) normal = facet;
                V3f turned;
                to_world.multDirMatrix(normal, turned);
                mesh.positions.push_back(positions[corner.vertex] * to_world);
                mesh.normals.push_back(turned.normalized());
                const V2f uv = corner.uv * repeat + offset;
                mesh.uvs.emplace_back(uv.x, 1 - uv.y);
            }
            const auto last = static_cast<uint32_t>(mesh.positions.size());
            mesh.triangles.push_back({last - 3, last - 2, last - 1});
        }
    }

    const std::filesystem::path& path_;
    std::ifstream file_;
    uintmax_t bytes_ = 0;
    std::vector<Look> materials_;
    std::vector<Piece> pieces_;
};

}  // namespace

std::vector<Piece> read_ac3d(const std::filesystem::path& path) { return Ac3dReader(path).read(); }

}  // namespace clarus::render
