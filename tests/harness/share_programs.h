#pragma once

#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "io/file.h"
#include "noise_sequence.h"
#include "program.h"
#include "share_harness.h"
#include "test_device.h"

namespace clarus::test {

// `clarus serve`, `play` and what belongs to them as processes.

class Workplace {
  public:
    explicit Workplace(int frames) { write_noise_sequence(sequence(), {24, 16}, frames); }

    std::string sequence() const { return (folder_ / "sequence").string(); }
    std::filesystem::path operator/(const std::filesystem::path& name) const { return folder_ / name; }
    RuntimeFolder runtime;

    std::unique_ptr<Program> serve(const std::string& model, const std::string& output,
                                   std::vector<std::string> more = {}) const {
        more.insert(more.begin(), {"serve", "game", "--model", model, "--device", test_selector(), "--output",
                                   (folder_ / output).string()});
        return std::make_unique<Program>(CLARUS_TOOL, more);
    }
    std::unique_ptr<Program> play(std::vector<std::string> more = {}) const {
        more.insert(more.begin(), {"play", sequence(), "--share", "game"});
        return std::make_unique<Program>(CLARUS_TOOL, more);
    }
    void upscale(const std::string& model, const std::string& output, std::vector<std::string> more = {}) const {
        more.insert(more.begin(), {"upscale", sequence(), "--model", model, "--device", test_selector(), "--output",
                                   (folder_ / output).string()});
        Program program(CLARUS_TOOL, more);
        REQUIRE(program.result() == 0);
    }
    std::string bytes(const std::filesystem::path& file) const { return io::read_file(folder_ / file); }
    std::set<std::string> files(const std::string& folder) const {
        std::set<std::string> names;
        if (exists(folder_ / folder))
            for (const auto& entry : std::filesystem::directory_iterator(folder_ / folder))
                if (entry.path().extension() != ".partial") names.insert(entry.path().filename());
        return names;
    }
    nlohmann::json description() const {
        return nlohmann::json::parse(io::read_file(folder_ / "sequence/sequence.json"));
    }
    void describe(const nlohmann::json& description) const {
        std::ofstream(folder_ / "sequence/sequence.json") << description.dump();
    }

  private:
    TemporaryFolder folder_;
};

/// Until it holds, for a minute.
template <typename Condition>
bool comes_true(Condition condition) {
    for (int i = 0; i < 3000; ++i) {
        if (condition()) return true;
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    return false;
}

inline bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

inline void check_same_files(const Workplace& place, const std::string& one, const std::string& other, size_t count) {
    CHECK(place.files(one).size() == count);
    REQUIRE(place.files(one) == place.files(other));
    for (const std::string& name : place.files(one))
        CHECK_MESSAGE(place.bytes(one + "/" + name) == place.bytes(other + "/" + name), name);
}

}  // namespace clarus::test
