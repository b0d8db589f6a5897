#include "render/sequence_writer.h"

#include <fmt/format.h>
#include <tbb/parallel_invoke.h>

#include <cstddef>
#include <ranges>
#include <utility>

#include "base/error.h"
#include "io/file.h"

namespace clarus::render {
namespace fs = std::filesystem;

SequenceWriter::SequenceWriter(fs::path folder, const RenderSettings& settings, double scale, bool replace) {
    sequence_.folder = std::move(folder);
    sequence_.render_size = settings.render_size;
    sequence_.scale = scale;
    sequence_.frame_rate = frame_rate;
    sequence_.color_space = settings.hdr ? ColorSpace::linear : ColorSpace::srgb;
    sequence_.motion.sampled_at_jitter = !settings.motion_at_centre;

    const fs::path index = sequence_.folder / "sequence.json";
    std::error_code error;
    if (fs::exists(index, error) && !replace) {
        fail(ErrorKind::file, "{} holds a sequence already; give another folder, or --force to replace it",
             sequence_.folder.string());
    }
    std::vector<fs::path> places = {sequence_.folder};
    for (const char* kind : {"color", "depth", "motion"}) places.push_back(sequence_.folder / kind);
    if (settings.reference_grid > 0) places.push_back(sequence_.folder / "reference");
    try {
        for (const fs::path& place : places) {
            if (fs::create_directories(place, error)) made_.push_back(place);
            if (error) fail(ErrorKind::file, "cannot make the folder {}: {}", place.string(), error.message());
        }
        // Shows whether the folder can be written to, and ends the old sequence, whose frames are about to go.
        constexpr std::byte nothing{};
        io::write_file_atomically(index, {&nothing, 1});
        fs::remove(index);
    } catch (...) {
        remove_files();
        throw;
    }
}

SequenceWriter::~SequenceWriter() {
    if (!finished_) remove_files();
}

void SequenceWriter::remove_files() noexcept {
    std::error_code ignored;
    for (const fs::path& path : made_ | std::views::reverse) fs::remove(path, ignored);
}

fs::path SequenceWriter::new_file(const char* kind, const std::string& name) {
    made_.push_back(sequence_.folder / kind / name);
    return made_.back();
}

void SequenceWriter::add(const RenderedFrame& frame, Vec2 jitter) {
    const bool hdr = sequence_.color_space == ColorSpace::linear;
    const io::SampleType picture_type = hdr ? io::SampleType::f16 : io::SampleType::u8;
    io::FrameFiles files;
    files.name = fmt::format("{:04}", sequence_.frames.size());
    files.jitter = jitter;
    files.reset = sequence_.frames.empty();
    const std::string picture = files.name + (hdr ? ".exr" : ".png"), data = files.name + ".exr";
    files.color = new_file("color", picture);
    files.depth = new_file("depth", data);
    files.motion = new_file("motion", data);
    if (!frame.reference.values.empty()) files.reference = new_file("reference", picture);
    tbb::parallel_invoke(
        [&] {
            io::write_image(files.color, frame.color, picture_type);
            io::write_image(files.depth, frame.depth, io::SampleType::f32);
            io::write_image(files.motion, frame.motion, io::SampleType::f32);
        },
        [&] {
            if (!files.reference.empty()) io::write_image(files.reference, frame.reference, picture_type);
        });
    sequence_.frames.push_back(std::move(files));
}

void SequenceWriter::finish() {
    io::write_sequence(sequence_, sequence_.folder);
    finished_ = true;
}

}  // namespace clarus::render
