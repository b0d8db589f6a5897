#include "cli/run_file.h"

#include <vector>

#include "io/json_reader.h"

namespace clarus::cli {

std::filesystem::path run_file(const std::filesystem::path& folder) { return folder / "report.json"; }

nlohmann::ordered_json read_run(const std::filesystem::path& folder) {
    const std::filesystem::path file = run_file(folder);
    if (!std::filesystem::exists(file)) return {};
    const nlohmann::json run = io::read_json(file);
    const io::JsonNode root(run, file);
    root["model"]["name"].text();
    const std::vector<io::JsonNode> devices = root["devices"].items();
    for (const io::JsonNode& device : devices) device["name"].text();
    root["precision"].text();
    root["output_size"].items(2);
    for (const io::JsonNode& stage : root["stages"].items()) {
        for (const char* key : {"name", "kernel"}) stage[key].text();
        for (const char* key : {"seconds", "operations", "bytes"}) stage[key].number(0, 1e30);
        stage["device"].number(-1, static_cast<double>(devices.size()) - 1);
    }
    const auto stages = static_cast<double>(root["stages"].items().size());
    for (const io::JsonNode& span : root["timeline"].items()) {
        span["stage"].number(0, stages - 1);
        for (const char* key : {"frame", "start", "end"}) span[key].number(0, 1e30);
    }
    for (const io::JsonNode& part : root["placement"].items())
        for (const io::JsonNode& stage : part["stages"].items()) stage.text();
    return run;
}

}  // namespace clarus::cli
