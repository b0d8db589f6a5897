#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <span>
#include <string>
#include <vector>

namespace clarus::cli {

/// Of io::images_in, the one of a name that must be there. Errors: file.
std::filesystem::path require_image(const std::map<std::string, std::filesystem::path>& images, const std::string& name,
                                    const std::filesystem::path& folder);

/// The name of the picture between a frame and the one before it (clarus upscale --frame-rate): sorted by name it comes
/// between theirs.
std::string name_before(const std::string& frame);

/// The last part of a path, however it was given: with a slash behind it, as ".".
std::string name_of(const std::filesystem::path& path);

/// Those of several; whole paths where they are not enough to tell them apart.
std::vector<std::string> names_of(std::span<const std::filesystem::path> paths);

/// What `clarus upscale --view` left in a result's folder: a folder a view.
std::set<std::filesystem::path> view_folders(const std::filesystem::path& result);

}  // namespace clarus::cli
