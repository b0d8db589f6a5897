#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <vector>

#include "api/kept_placement.h"
#include "cache_folder.h"
#include "temporary_folder.h"

using namespace clarus;

namespace {

/// What is kept of a network of three nodes on two devices.
class Kept {
  public:
    Kept()
        : cache_(folder_.path()),
          placement_(network(), std::vector<DeviceProfile>(2), [](int, int) { return false; }, {}) {
        placement_.keep({{0, 0, 0}, {{0, 0, 0}, {0, 0, 0}}});
        file_ = std::filesystem::directory_iterator(folder_ / "placements")->path();
    }

    KeptPlacement::Choice read(const uint8_t* data, size_t size) const {
        std::ofstream(file_, std::ios::binary)
            .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
        return placement_.find();
    }

  private:
    static graph::Graph network() {
        graph::Graph graph;
        const graph::Value color = graph.input(graph::Resource::color, {8, 8});
        graph.output = graph.sum(color, graph.round(color, "round"), "sum");
        return graph;
    }

    TemporaryFolder folder_;
    CacheFolder cache_;
    KeptPlacement placement_;
    std::filesystem::path file_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    static const Kept kept;
    const KeptPlacement::Choice choice = kept.read(data, size);
    if (choice.places.empty()) return 0;
    // No number has become another.
    const nlohmann::json said = nlohmann::json::parse(data, data + size);
    if (said.at("places") != nlohmann::json(choice.places) || choice.seconds.size() != 2) __builtin_trap();
    for (const int place : choice.places)
        if (place < 0 || place > 1) __builtin_trap();
    return 0;
}
