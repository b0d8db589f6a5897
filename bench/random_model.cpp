#include "bench/random_model.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <vector>

namespace clarus::bench {
namespace {

class RandomModel {
  public:
    explicit RandomModel(nlohmann::json metadata) { header_["__metadata__"] = std::move(metadata); }

    void add(const std::string& name, const std::vector<int>& shape) {
        size_t count = 1;
        for (const int extent : shape) count *= extent;
        std::uniform_real_distribution<float> weight(-0.1f, 0.1f);
        const size_t begin = body_.size() * sizeof(float);
        for (size_t i = 0; i < count; ++i) body_.push_back(weight(generator_));
        header_[name] = {{"dtype", "F32"}, {"shape", shape}, {"data_offsets", {begin, body_.size() * sizeof(float)}}};
    }

    void add_layer(const std::string& name, int in, int out, int kernel = 3) {
        add(name + ".weight", {out, in, kernel, kernel});
        add(name + ".bias", {out});
    }
    /// NAME.0, NAME.1, …, of as many outputs as told.
    void add_layers(const std::string& name, int in, const std::vector<int>& outputs, int kernel = 3) {
        for (size_t layer = 0; layer < outputs.size(); ++layer)
            add_layer(name + "." + std::to_string(layer), layer == 0 ? in : outputs[layer - 1], outputs[layer], kernel);
    }

    Model load() const {
        std::string name = (std::filesystem::temp_directory_path() / "clarus-bench-XXXXXX").string();
        const std::filesystem::path folder = mkdtemp(name.data());
        write(folder / "random.safetensors");
        Model model = Model::load((folder / "random.safetensors").string());
        std::filesystem::remove_all(folder);
        return model;
    }

  private:
    void write(const std::filesystem::path& path) const {
        const std::string text = header_.dump();
        const uint64_t length = text.size();
        std::ofstream file(path, std::ios::binary);
        file.exceptions(std::ios::failbit | std::ios::badbit);
        file.write(reinterpret_cast<const char*>(&length), sizeof(length));
        file.write(text.data(), static_cast<std::streamsize>(text.size()));
        file.write(reinterpret_cast<const char*>(body_.data()),
                   static_cast<std::streamsize>(body_.size() * sizeof(float)));
    }

    nlohmann::json header_;
    std::vector<float> body_;
    std::mt19937 generator_{1};
};

}  // namespace

Model random_enss(int scale, int features, int middle) {
    const int inputs = 6 + 4 * scale * scale, outputs = 5 * scale * scale;
    RandomModel model({{"pipeline", "enss"}, {"scale", std::to_string(scale)}});
    model.add("first.weight", {1, features, inputs, 3, 3});
    model.add("first.bias", {1, features});
    for (int layer = 0; layer < middle; ++layer) model.add_layer("body." + std::to_string(layer), features, features);
    model.add("last.weight", {1, outputs, features, 3, 3});
    model.add("last.bias", {1, outputs});
    return model.load();
}

Model random_nsrr(int scale, int previous_frames, int width) {
    constexpr int kMap = 12;
    const int n = previous_frames, w = width;
    RandomModel model({{"pipeline", "nsrr"},
                       {"scale", std::to_string(scale)},
                       {"previous_frames", std::to_string(n)},
                       {"network_color", "ycbcr"}});
    model.add_layers("features_current", 4, {32, 32, kMap - 4});
    if (n > 0) {
        model.add_layers("features_previous", 4, {32, 32, kMap - 4});
        model.add_layers("reweight", 4 + 4 * n, {32, 32, n});
    }
    model.add_layers("unet.enc1", kMap * (1 + n), {2 * w, w});
    model.add_layers("unet.enc2", w, {2 * w, 2 * w});
    model.add_layers("unet.bottleneck", 2 * w, {4 * w, 4 * w});
    model.add_layers("unet.dec2", 6 * w, {2 * w, 2 * w});
    model.add_layers("unet.dec1", 3 * w, {w, 3});
    return model.load();
}

Model random_mnss(int scale) {
    RandomModel model({{"pipeline", "mnss"}, {"scale", std::to_string(scale)}});
    model.add_layer("inpaint", 4, 1);
    model.add_layers("antialias", 6, {8, 3});
    model.add_layers("reconstruct", 3, {16, 32, 32, 3});
    return model.load();
}

Model random_srpo(int scale) {
    RandomModel model({{"pipeline", "srpo"}, {"scale", std::to_string(scale)}});
    model.add_layers("conv", 3, {16, 16, 2}, 5);
    return model.load();
}

}  // namespace clarus::bench
