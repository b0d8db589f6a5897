#include "bench/random_model.h"

#include <fstream>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <vector>

namespace clarus::bench {

void write_random_enss(const std::filesystem::path& path, int scale, int features, int middle) {
    const int inputs = 6 + 4 * scale * scale, outputs = 5 * scale * scale;
    std::vector<float> body;
    nlohmann::json header = {{"__metadata__", {{"pipeline", "enss"}, {"scale", std::to_string(scale)}}}};
    std::mt19937 generator(1);
    const auto add = [&](const std::string& name, const std::vector<int>& shape) {
        size_t count = 1;
        for (const int extent : shape) count *= extent;
        std::uniform_real_distribution<float> weight(-0.1f, 0.1f);
        const size_t begin = body.size() * sizeof(float);
        for (size_t i = 0; i < count; ++i) body.push_back(weight(generator));
        header[name] = {{"dtype", "F32"}, {"shape", shape}, {"data_offsets", {begin, body.size() * sizeof(float)}}};
    };
    add("first.weight", {1, features, inputs, 3, 3});
    add("first.bias", {1, features});
    for (int layer = 0; layer < middle; ++layer) {
        add("body." + std::to_string(layer) + ".weight", {features, features, 3, 3});
        add("body." + std::to_string(layer) + ".bias", {features});
    }
    add("last.weight", {1, outputs, features, 3, 3});
    add("last.bias", {1, outputs});

    const std::string text = header.dump();
    const uint64_t length = text.size();
    std::ofstream file(path, std::ios::binary);
    file.exceptions(std::ios::failbit | std::ios::badbit);
    file.write(reinterpret_cast<const char*>(&length), sizeof(length));
    file.write(text.data(), static_cast<std::streamsize>(text.size()));
    file.write(reinterpret_cast<const char*>(body.data()), static_cast<std::streamsize>(body.size() * sizeof(float)));
}

}  // namespace clarus::bench
