#include "measure/checks.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <span>

#include "base/error.h"
#include "base/hash.h"
#include "base/json_text.h"
#include "base/place.h"
#include "io/file.h"
#include "io/json_reader.h"
#include "io/safetensors.h"
#include "measure/test_sequence.h"

namespace clarus::measure {
namespace {

constexpr const char* kFormat = "clarus-bench-checks";
constexpr double kDigits = 1e6;  // kept after the point

}  // namespace

Sketch sketch(Size size, const std::vector<float>& pixels) {
    std::array<double, kCells * kCells> sums{}, counts{};
    for (int y = 0; y < size.height; ++y) {
        const int row = y * kCells / size.height;
        for (int x = 0; x < size.width; ++x) {
            const size_t pixel = static_cast<size_t>(y) * size.width + x;
            const uint32_t signs = hash(static_cast<uint32_t>(pixel));
            const int cell = row * kCells + x * kCells / size.width;
            for (int channel = 0; channel < 3; ++channel) {
                const float value = pixels[3 * pixel + channel];
                sums[cell] += signs >> channel & 1 ? value : -value;
            }
            counts[cell] += 3;
        }
    }
    Sketch result{};
    for (size_t cell = 0; cell < result.size(); ++cell)  // a small image leaves cells empty
        if (counts[cell] > 0) result[cell] = static_cast<float>(sums[cell] / std::sqrt(counts[cell]));
    return result;
}

double difference(const Sketch& a, const Sketch& b) {
    double largest = 0;
    for (size_t cell = 0; cell < a.size(); ++cell) {
        const double distance = std::abs(static_cast<double>(a[cell]) - b[cell]);
        if (std::isnan(distance)) return distance;
        largest = std::max(largest, distance);
    }
    return largest;
}

double tolerance(Precision precision) { return precision == Precision::fp32 ? 1e-3 : 1e-2; }

std::string checksum(const Model& model) {
    if (!model.tensors()) return {};
    return hexadecimal(hash_of(io::read_file(model.tensors()->path())));
}

Checks Checks::read(const std::filesystem::path& path) {
    const nlohmann::json json = io::read_json(path);
    const io::JsonNode file(json, path);
    file["format"].choice<int>({{kFormat, 1}});
    file["version"].integer(1, 1);
    Checks checks;
    for (const io::JsonNode& entry : file["checks"].items()) {
        const std::vector<io::JsonNode> size = entry["render_size"].items(2);
        Expected expected{entry["checksum"].text(), {}};
        const std::vector<io::JsonNode> values = entry["sketch"].items(expected.sketch.size());
        std::transform(values.begin(), values.end(), expected.sketch.begin(),
                       [](const io::JsonNode& value) { return static_cast<float>(value.number(-1e9, 1e9)); });
        const Key key{entry["model"].text(), entry["scale"].number(1, 64),
                      static_cast<int>(size[0].integer(1, 1 << 15)), static_cast<int>(size[1].integer(1, 1 << 15))};
        checks.expected_[key] = std::move(expected);
    }
    return checks;
}

void Checks::write(const std::filesystem::path& path) const {
    // A line an entry, so that a change of the file shows which model it is of.
    std::string lines;
    for (const auto& [key, expected] : expected_) {
        nlohmann::ordered_json values = nlohmann::ordered_json::array();
        for (const float value : expected.sketch) values.push_back(std::round(kDigits * value) / kDigits);
        const nlohmann::ordered_json entry{{"model", key.model},
                                           {"scale", key.scale},
                                           {"render_size", {key.width, key.height}},
                                           {"checksum", expected.checksum},
                                           {"sketch", values}};
        lines += (lines.empty() ? "" : ",\n") + json_text(entry);
    }
    const std::string text =
        fmt::format("{{\"format\": \"{}\", \"version\": 1, \"checks\": [\n{}\n]}}\n", kFormat, lines);
    io::write_file_atomically(path, std::as_bytes(std::span(text)));
}

const Sketch* Checks::find(const Model& model, Size render) const {
    const auto found = expected_.find({model.name(), model.scale(), render.width, render.height});
    return found != expected_.end() && found->second.checksum == checksum(model) ? &found->second.sketch : nullptr;
}

void Checks::set(const Model& model, Size render, const Sketch& expected) {
    expected_[{model.name(), model.scale(), render.width, render.height}] = {checksum(model), expected};
}

std::filesystem::path shipped_checks() { return data_folder() / "bench-checks.json"; }

}  // namespace clarus::measure
