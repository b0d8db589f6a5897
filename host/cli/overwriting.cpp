#include "cli/overwriting.h"

#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "base/error.h"
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

/// Everything that the run reads or writes, by what it is; but for figures.
std::map<std::filesystem::path, std::string> files_of(const std::filesystem::path& sequence_path,
                                                      const io::Sequence& sequence, const Model& model,
                                                      const FrameOutput& output) {
    std::map<std::filesystem::path, std::string> files{{resolved(sequence_path), "the sequence"}};
    if (model.tensors()) files[resolved(model.tensors()->path())] = "the model";
    for (const std::filesystem::path& file : images_of(sequence)) files[resolved(file)] = "an image of the sequence";
    for (const io::FrameFiles& frame : sequence.frames) {
        files[resolved(output.file(frame.name))] = "an image of --output";
        for (const std::string& view : output.views)
            files[resolved(output.view_file(view, frame.name))] = "a picture of --view";
    }
    return files;
}

}  // namespace

std::filesystem::path folder_of(const std::filesystem::path& file) {
    return file.has_parent_path() ? file.parent_path() : ".";
}

void keep_what_there_is(const std::filesystem::path& sequence_path, const io::Sequence& sequence, const Model& model,
                        const FrameOutput& output, const std::filesystem::path& report,
                        const std::filesystem::path& trace) {
    std::set<std::filesystem::path> folders, image_folders;
    for (const std::filesystem::path& file : images_of(sequence)) folders.insert(folder_of(file));
    for (const std::filesystem::path& folder : folders) image_folders.insert(resolved(folder));
    if (image_folders.contains(resolved(output.folder)))
        fail(ErrorKind::invalid_argument, "--output {} holds images of the sequence; name another folder",
             output.folder.string());

    auto taken = files_of(sequence_path, sequence, model, output);
    for (const auto& [option, file] : {std::pair("--report", report), {"--trace", trace}}) {
        if (file.empty()) continue;
        if (const auto [other, is_new] = taken.emplace(resolved(file), option); !is_new)
            fail(ErrorKind::invalid_argument, "{} {} would replace {}; name another file", option, file.string(),
                 other->second);
        const std::filesystem::path folder = resolved(folder_of(file));
        if (folder == resolved(folder_of(sequence.folder / "")) || image_folders.contains(folder))
            fail(ErrorKind::invalid_argument, "{} {} would lie among the sequence's own files; name another folder",
                 option, file.string());
    }
}

}  // namespace clarus::cli
