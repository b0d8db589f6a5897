#include "render/sequence_writer.h"

#include <fmt/format.h>
#include <tbb/parallel_invoke.h>

#include <ranges>
#include <span>

#include "base/error.h"
#include "io/file.h"

namespace clarus::render {
namespace fs = std::filesystem;

namespace {

/// Whole numbers as such, so that the file reads as people write it.
nlohmann::ordered_json number(double value) {
    if (value == static_cast<int>(value)) return static_cast<int>(value);
    return value;
}

}  // namespace

SequenceWriter::SequenceWriter(fs::path folder, const RenderSettings& settings, double scale, bool replace)
    : folder_(std::move(folder)), hdr_(settings.hdr) {
    const fs::path index = folder_ / "sequence.json";
    std::error_code error;
    if (fs::exists(index, error) && !replace) {
        fail(ErrorKind::file, "{} holds a sequence already; give another folder, or --force to replace it",
             folder_.string());
    }
    try {
        for (const char* kind : {"", "color", "depth", "motion", "reference"}) {
            const fs::path place = folder_ / kind;
            if (kind == std::string("reference") && settings.reference_grid == 0) continue;
            if (fs::create_directories(place, error)) written_.push_back(place);
            if (error) fail(ErrorKind::file, "cannot make the folder {}: {}", place.string(), error.message());
        }
        // An empty index is no sequence; writing it shows whether the folder can be written to.
        io::write_file_atomically(index, {});
        fs::remove(index);
    } catch (...) {
        remove_files();
        throw;
    }
    const char* sampled_at = settings.motion_at_centre ? "centre" : "jittered";
    description_ = {{"version", 1},
                    {"render_size", {settings.render_size.width, settings.render_size.height}},
                    {"scale", number(scale)},
                    {"frame_rate", 60},
                    {"color_space", settings.hdr ? "linear" : "srgb"},
                    {"depth", {{"encoding", "linear"}, {"reversed", false}}},
                    {"motion",
                     {{"unit", "pixels"},
                      {"direction", "to_previous"},
                      {"y", "down"},
                      {"jittered", false},
                      {"sampled_at", sampled_at}}},
                    {"frames", nlohmann::ordered_json::array()}};
}

SequenceWriter::~SequenceWriter() {
    if (!finished_) remove_files();
}

void SequenceWriter::remove_files() noexcept {
    std::error_code ignored;
    for (const fs::path& path : written_ | std::views::reverse) fs::remove(path, ignored);
}

fs::path SequenceWriter::new_file(const char* kind, const std::string& name) {
    written_.push_back(folder_ / kind / name);
    return written_.back();
}

void SequenceWriter::add(const RenderedFrame& frame, Vec2 jitter) {
    auto& frames = description_["frames"];
    const std::string number = fmt::format("{:04}", frames.size()), picture = number + (hdr_ ? ".exr" : ".png"),
                      data = number + ".exr";
    nlohmann::ordered_json entry = {{"color", "color/" + picture},
                                    {"depth", "depth/" + data},
                                    {"motion", "motion/" + data},
                                    {"jitter", {jitter.x, jitter.y}}};
    if (frames.empty()) entry["reset"] = true;
    const fs::path color = new_file("color", picture), depth = new_file("depth", data),
                   motion = new_file("motion", data);
    const io::SampleType picture_type = hdr_ ? io::SampleType::f16 : io::SampleType::u8;
    const auto write_inputs = [&] {
        io::write_image(color, frame.color, picture_type);
        io::write_image(depth, frame.depth, io::SampleType::f32);
        io::write_image(motion, frame.motion, io::SampleType::f32);
    };
    if (frame.reference.values.empty()) {
        write_inputs();
    } else {
        const fs::path reference = new_file("reference", picture);
        entry["reference"] = "reference/" + picture;
        tbb::parallel_invoke(write_inputs, [&] { io::write_image(reference, frame.reference, picture_type); });
    }
    frames.push_back(std::move(entry));
}

void SequenceWriter::finish() {
    const std::string text = description_.dump(2) + "\n";
    io::write_file_atomically(folder_ / "sequence.json", std::as_bytes(std::span(text)));
    finished_ = true;
}

}  // namespace clarus::render
