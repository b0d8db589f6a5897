#include "cli/check_correction.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <span>

#include "base/error.h"
#include "base/json_text.h"
#include "io/file.h"
#include "io/json_reader.h"

namespace clarus::cli {
namespace {

namespace fs = std::filesystem;

// Numbers as float: a jitter of −1/6 is then written with the digits that it has.
using Json = nlohmann::basic_json<nlohmann::ordered_map, std::vector, std::string, bool, int64_t, uint64_t, float>;

fs::path json_of(const fs::path& sequence) {
    return fs::is_directory(sequence) ? sequence / "sequence.json" : sequence;
}

/// Every frame's image of this kind becomes that of the frame `offset` later; frames that have none are left out, but
/// for motion of a reset, which is not read.
void shift_images(Json& frames, const char* key, int offset, std::vector<std::string>& lines) {
    if (offset == 0) return;
    const Json before = frames;
    const auto count = static_cast<int>(before.size());
    Json shifted = Json::array();
    for (int i = 0; i < count; ++i) {
        Json frame = before[static_cast<size_t>(i)];
        const int from = i + offset;
        const bool is_there = from >= 0 && from < count && before[static_cast<size_t>(from)].contains(key);
        if (is_there)
            frame[key] = before[static_cast<size_t>(from)][key];
        else if (!(i == 0 && std::string_view(key) == "motion")) {
            lines.push_back(fmt::format("frames[{}] is left out: its own {} is not there", i, key));
            continue;
        }
        shifted.push_back(std::move(frame));
    }
    frames = std::move(shifted);
}

void correct_jitter(Json& frames, const check::Correction& correction) {
    const Json before = frames;
    const auto count = static_cast<int>(before.size());
    for (int i = 0; i < count; ++i) {
        const int from = std::clamp(i + correction.reading.jitter_frame, 0, count - 1);
        const Json& stored = before[static_cast<size_t>(from)]["jitter"];
        Vec2 jitter = correction.reading.oriented({stored[0].get<float>(), stored[1].get<float>()});
        if (correction.no_jitter) jitter = {};
        frames[static_cast<size_t>(i)]["jitter"] = {jitter.x, jitter.y};
    }
}

void correct_motion(Json& motion, const check::Correction& correction) {
    const check::Reading& reading = correction.reading;
    if (reading.unit == check::Unit::pixels) motion["unit"] = "pixels";
    if (reading.unit == check::Unit::uv) motion["unit"] = "uv";
    motion["direction"] = reading.from_previous ? "from_previous" : "to_previous";
    motion["y"] = reading.y_up ? "up" : "down";
    motion["jittered"] = reading.jittered;
}

/// Of a sequence that was read. Errors: file, where a number that nobody reads is none that a float can be.
Json description_of(const fs::path& file) {
    try {
        return Json::parse(io::read_file(file, io::largest_json));
    } catch (const Json::exception& error) {
        fail(ErrorKind::file, "cannot correct {}: {}", file.string(), error.what());
    }
}

}  // namespace

fs::path corrected_name(const fs::path& sequence) {
    fs::path file = json_of(sequence);
    return file.replace_extension(".fixed.json");
}

void require_correctable(const fs::path& sequence, const fs::path& corrected) {
    const fs::path file = json_of(sequence);
    if (file.extension() != ".json" || !fs::is_regular_file(file))
        fail(ErrorKind::invalid_argument, "--fix writes a corrected JSON of the native layout, and {} has none",
             sequence.string());
    if (fs::exists(corrected))
        fail(ErrorKind::file, "--fix would replace {}; move it away or take it as the sequence", corrected.string());
}

std::vector<std::string> write_correction(const fs::path& sequence, const fs::path& corrected,
                                          const check::Correction& correction, size_t first) {
    std::vector<std::string> lines;
    Json json = description_of(json_of(sequence));
    Json& frames = json["frames"];
    if (!correction.order.empty()) {
        const Json before = frames;
        for (size_t i = 0; i < correction.order.size(); ++i) frames[first + i] = before[first + correction.order[i]];
    }
    correct_jitter(frames, correction);
    shift_images(frames, "motion", correction.reading.motion_frame, lines);
    shift_images(frames, "depth", correction.depth_frame, lines);
    // Without motion images it may be anything: it is not read.
    if (json.contains("motion") && json["motion"].is_object()) correct_motion(json["motion"], correction);
    if (correction.depth_projective) json["depth"]["encoding"] = *correction.depth_projective ? "projective" : "linear";
    if (correction.depth_reversed) json["depth"]["reversed"] = *correction.depth_reversed;
    if (correction.color_space) json["color_space"] = *correction.color_space == ColorSpace::linear ? "linear" : "srgb";
    for (const std::string& what : correction.unsayable)
        lines.push_back("not corrected, since the JSON cannot say it: " + what);
    const std::string text = json_text(json, 1) + "\n";
    io::write_file_atomically(corrected, std::as_bytes(std::span(text)));
    lines.push_back(corrected.string() + ": with what was found put right; check it, too");
    return lines;
}

}  // namespace clarus::cli
