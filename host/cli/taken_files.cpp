#include "cli/taken_files.h"

#include <system_error>

#include "base/error.h"

namespace clarus::cli {

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

std::set<std::filesystem::path> folders_of(const std::vector<std::filesystem::path>& files) {
    std::set<std::filesystem::path> folders, result;
    for (const std::filesystem::path& file : files) folders.insert(folder_of(file));
    for (const std::filesystem::path& folder : folders) result.insert(resolved(folder));
    return result;
}

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

void TakenFiles::add_folder(const std::filesystem::path& folder) { folders_.insert(resolved(folder_of(folder / ""))); }

void TakenFiles::take(const std::string& option, const std::filesystem::path& file) {
    std::error_code unreadable;
    const std::filesystem::file_status status = std::filesystem::status(file, unreadable);
    if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status) &&
        !std::filesystem::is_directory(status))  // which is told where folders are
        fail(ErrorKind::file, "{} {}: that is no regular file", option, file.string());
    if (const auto [other, is_new] = files_.emplace(resolved(file), option); !is_new)
        fail(ErrorKind::invalid_argument, "{} {} would replace {}; name another file", option, file.string(),
             other->second);
    if (folders_.contains(resolved(folder_of(file))))
        fail(ErrorKind::invalid_argument, "{} {} would lie among the sequence's own files; name another folder", option,
             file.string());
}

}  // namespace clarus::cli
