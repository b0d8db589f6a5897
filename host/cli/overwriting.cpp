#include "cli/overwriting.h"

#include <vector>

#include "base/error.h"
#include "cli/run_state.h"
#include "io/safetensors.h"

namespace clarus::cli {
namespace {

// Where a file or folder is or would be, past links.
std::filesystem::path resolved(const std::filesystem::path& path) {
    std::error_code unreadable;
    const std::filesystem::path absolute = std::filesystem::absolute(path);
    const std::filesystem::path result = std::filesystem::weakly_canonical(absolute, unreadable);
    return unreadable ? absolute : result;
}

std::vector<std::filesystem::path> images_of(const io::Sequence& sequence) {
    std::vector<std::filesystem::path> images;
    for (const io::FrameFiles& frame : sequence.frames) {
        for (const std::filesystem::path& file : {frame.color, frame.depth, frame.motion, frame.reference})
            if (!file.empty()) images.push_back(file);
        for (const auto& [kind, file] : frame.optional) images.push_back(file);
    }
    return images;
}

// Where they lie, past links.
std::set<std::filesystem::path> folders_of(const std::vector<std::filesystem::path>& files) {
    std::set<std::filesystem::path> folders, result;
    for (const std::filesystem::path& file : files) folders.insert(folder_of(file));
    for (const std::filesystem::path& folder : folders) result.insert(resolved(folder));
    return result;
}

}  // namespace

std::filesystem::path folder_of(const std::filesystem::path& file) {
    return file.has_parent_path() ? file.parent_path() : ".";
}

void TakenFiles::add(const std::filesystem::path& file, const std::string& what) { files_[resolved(file)] = what; }

void TakenFiles::add(const std::filesystem::path& sequence_path, const io::Sequence& sequence) {
    add(sequence_path, "the sequence");
    const std::vector<std::filesystem::path> images = images_of(sequence);
    for (const std::filesystem::path& file : images) add(file, "an image of the sequence");
    folders_.merge(folders_of(images));
    folders_.insert(resolved(folder_of(sequence.folder / "")));
}

void TakenFiles::take(const std::string& option, const std::filesystem::path& file) {
    if (const auto [other, is_new] = files_.emplace(resolved(file), option); !is_new)
        fail(ErrorKind::invalid_argument, "{} {} would replace {}; name another file", option, file.string(),
             other->second);
    if (folders_.contains(resolved(folder_of(file))))
        fail(ErrorKind::invalid_argument, "{} {} would lie among the sequence's own files; name another folder", option,
             file.string());
}

void refuse_overwriting_inputs(const std::filesystem::path& sequence_path, const io::Sequence& sequence,
                               const Model& model, const FrameOutput& output, const std::filesystem::path& report,
                               const std::filesystem::path& trace) {
    if (!output.writer && folders_of(images_of(sequence)).contains(resolved(output.folder)))
        fail(ErrorKind::invalid_argument, "--output {} holds images of the sequence; name another folder",
             output.folder.string());
    if (!output.writer && resolved(output.folder) == resolved(folder_of(sequence.folder / "")))
        fail(ErrorKind::invalid_argument, "--output {} is the sequence's own folder; name another",
             output.folder.string());

    TakenFiles taken;
    taken.add(sequence_path, sequence);
    if (model.tensors()) taken.add(model.tensors()->path(), "the model");
    if (output.writer)
        taken.take("--output", output.video);
    else
        taken.add(run_state_file(output.folder), "the run's state");
    for (const io::FrameFiles& frame : sequence.frames) {
        if (output.writer) break;
        taken.add(output.file(frame.name), "an image of --output");
        if (output.interpolated) taken.add(output.file_before(frame.name), "an image of --output");
        for (const std::string& view : output.views)
            taken.add(output.view_file(view, frame.name), "a picture of --view");
    }
    if (!report.empty()) taken.take("--report", report);
    if (!trace.empty()) taken.take("--trace", trace);
}

}  // namespace clarus::cli
