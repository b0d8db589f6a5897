#include "render/sequence_writer.h"

#include <fmt/format.h>
#include <tbb/parallel_for_each.h>

#include <algorithm>
#include <cstddef>
#include <optional>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/hash.h"
#include "base/json_text.h"
#include "base/log.h"
#include "io/encode.h"
#include "io/file.h"
#include "io/json_reader.h"

namespace clarus::render {
namespace fs = std::filesystem;
namespace {

std::vector<fs::path> images(const io::FrameFiles& frame) {
    std::vector<fs::path> files{frame.color, frame.depth, frame.motion};
    if (!frame.reference.empty()) files.push_back(frame.reference);
    for (const auto& [key, file] : frame.optional) files.push_back(file);
    return files;
}

void make_folder(const fs::path& folder) {
    std::error_code error;
    if (!folder.empty()) fs::create_directories(folder, error);
    if (error) fail(ErrorKind::file, "cannot make the folder {}: {}", folder.string(), error.message());
}

/// Of a frame's images, all of which are there.
std::string hash_of_images(const io::FrameFiles& frame) {
    std::string hashes;
    for (const fs::path& image : images(frame)) hashes += hexadecimal(hash_of(io::read_file(image)));
    return hexadecimal(hash_of(hashes));
}

/// Since its images were hashed: what was on its way to the disk when the machine failed may be there in part.
bool is_as_it_was(const io::FrameFiles& frame, const std::string& hash) {
    for (const fs::path& image : images(frame))
        if (!fs::exists(image)) return false;
    if (hash_of_images(frame) == hash) return true;
    log(LogLevel::warning, "an image of frame {} is not as it was rendered. It is rendered again", frame.name);
    return false;
}

/// Frames of an earlier sequence, which may have had more of them: images named as this one is. Some layouts find their
/// frames by looking.
void remove_frames_like(const fs::path& image) {
    const std::vector<fs::directory_entry> entries(fs::directory_iterator(image.parent_path()),
                                                   fs::directory_iterator{});
    for (const fs::directory_entry& entry : entries) {
        const fs::path& file = entry.path();
        const std::string stem = file.stem().string();
        if (entry.is_regular_file() && file.extension() == image.extension() &&
            stem.size() >= image.stem().string().size() && stem.find_first_not_of("0123456789") == std::string::npos)
            fs::remove(entry);
    }
}

}  // namespace

SequenceWriter::SequenceWriter(std::unique_ptr<io::OutputLayout> layout, io::Sequence sequence,
                               const RenderSettings& settings, nlohmann::ordered_json recipe, bool replace)
    : layout_(std::move(layout)),
      sequence_(std::move(sequence)),
      has_reference_(settings.reference_grid > 0),
      has_output_buffers_(settings.output_buffers),
      recipe_(std::move(recipe)),
      unfinished_(layout_->description().replace_extension(".unfinished.json")) {
    begin(replace);
}

void SequenceWriter::begin(bool replace) {
    const fs::path description = layout_->description();
    std::error_code error;
    if (!replace && fs::exists(description, error)) {
        fail(ErrorKind::file, "{} is there already; give another folder, or --force to replace the sequence",
             description.string());
    }
    if (!replace && fs::exists(unfinished_, error)) {
        const nlohmann::json record = read_record();
        const io::JsonNode root(record, unfinished_);
        for (const auto& [key, value] : recipe_.items())
            if (!record["recipe"].contains(key))
                fail(ErrorKind::file,
                     "{} is the beginning of a sequence by another version, which had no {}; give another folder, or "
                     "--force to replace it",
                     unfinished_.string(), key);
        for (const auto& [key, value] : root["recipe"].members()) {
            if (!recipe_.contains(key) || record["recipe"][key] != nlohmann::json(recipe_[key])) {
                fail(ErrorKind::file,
                     "{} is the beginning of another sequence: its {} is {}; give the same options to continue it, "
                     "another folder, or --force to replace it",
                     unfinished_.string(), key, json_text(record["recipe"][key]));
            }
        }
        for (const io::JsonNode& hash : root["frames_done"].items()) done_.push_back(hash.text());
    }
    replaces_ = fs::exists(description, error) || fs::exists(unfinished_, error);
    make_folder(description.parent_path());
    for (const fs::path& image : images(files(0))) {
        if (image.parent_path() != description.parent_path() && fs::is_symlink(image.parent_path(), error))
            fail(ErrorKind::file, "{} is a link, and a sequence's images lie in its own folder; give another folder",
                 image.parent_path().string());
        make_folder(image.parent_path());
        if (!replaces_) refuse_foreign(image);
    }
    // From here on the old sequence is none.
    note_progress();
    if (!replace || !replaces_) return;
    fs::remove(description);
    for (const fs::path& image : images(files(0))) remove_frames_like(image);
}

void SequenceWriter::refuse_foreign(const fs::path& image) const {
    if (fs::exists(fs::symlink_status(image)))
        fail(ErrorKind::file, "{} is there already, and of no sequence that {} describes; give another folder",
             image.string(), layout_->description().string());
}

nlohmann::json SequenceWriter::read_record() const {
    try {
        nlohmann::json record = io::read_json(unfinished_);
        const io::JsonNode root(record, unfinished_);
        root["recipe"].members();
        for (const io::JsonNode& hash : root["frames_done"].items()) hash.text();
        return record;
    } catch (const Error& error) {
        fail(ErrorKind::file,
             "{}. It said how far a render had come; give another folder, or --force to begin again here",
             error.what());
    }
}

void SequenceWriter::note_progress() const {
    const nlohmann::ordered_json record = {{"frames_done", done_}, {"recipe", recipe_}};
    const std::string text = json_text(record, 1) + "\n";
    io::write_file_atomically(unfinished_, std::as_bytes(std::span(text)));
}

io::FrameFiles SequenceWriter::files(size_t index) const {
    io::FrameFiles frame = layout_->place(sequence_, index);
    if (!has_reference_) frame.reference.clear();
    if (!has_output_buffers_) frame.optional.clear();
    return frame;
}

void SequenceWriter::add(const io::FrameFiles& description, const std::function<RenderedFrame()>& render) {
    const size_t index = sequence_.frames.size();
    io::FrameFiles frame = files(index);
    frame.render_size = description.render_size;
    frame.jitter = description.jitter;
    frame.reset = description.reset || index == 0;
    frame.near_plane = description.near_plane;
    frame.far_plane = description.far_plane;
    frame.camera = description.camera;
    if (index >= done_.size() || !is_as_it_was(frame, done_[index])) {
        if (!replaces_) std::ranges::for_each(images(frame), [this](const fs::path& image) { refuse_foreign(image); });
        write(frame, render());
        done_.resize(std::max(done_.size(), index + 1));
        done_[index] = hash_of_images(frame);
        note_progress();
    }
    sequence_.frames.push_back(std::move(frame));
}

void SequenceWriter::write(const io::FrameFiles& frame, const RenderedFrame& images) const {
    const Vec2 previous_jitter = sequence_.frames.empty() ? frame.jitter : sequence_.frames.back().jitter;
    const io::SampleType picture =
        sequence_.color_space == ColorSpace::linear ? io::SampleType::f16 : io::SampleType::u8;
    const bool packed = sequence_.depth_storage == io::DepthStorage::packed_rgba8;
    io::Sequence without_jitter = sequence_;
    without_jitter.motion.jittered = false;

    std::vector<std::function<void()>> writes = {
        [&] { io::write_image(frame.color, images.color, picture); },
        [&] {
            io::write_image(frame.depth, io::encode_depth(images.depth, sequence_, frame),
                            packed ? io::SampleType::u8 : io::SampleType::f32);
        },
        [&] {
            io::write_image(frame.motion,
                            io::encode_motion(images.motion, sequence_, frame, frame.jitter, previous_jitter),
                            io::SampleType::f32);
        }};
    if (has_reference_) writes.push_back([&] { io::write_image(frame.reference, images.reference, picture); });
    if (has_output_buffers_) {
        const auto& file = frame.optional;
        writes.push_back([&] { io::write_image(file.at("reference_aliased"), images.aliased, picture); });
        writes.push_back([&] {
            io::write_image(file.at("reference_depth"), io::encode_depth(images.output_depth, sequence_, frame),
                            io::SampleType::f32);
        });
        writes.push_back([&] {
            io::write_image(file.at("reference_motion"),
                            io::encode_motion(images.output_motion, without_jitter, frame, {}, {}),
                            io::SampleType::f32);
        });
    }
    tbb::parallel_for_each(writes, [](const auto& write_one) { write_one(); });
}

void SequenceWriter::finish() {
    layout_->describe(sequence_);
    std::error_code ignored;
    fs::remove(unfinished_, ignored);
}

}  // namespace clarus::render
