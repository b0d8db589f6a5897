#pragma once

#include <filesystem>
#include <map>
#include <string>

namespace clarus::cli {

/// Of io::images_in, the one of a name that must be there. Errors: file.
std::filesystem::path require_image(const std::map<std::string, std::filesystem::path>& images, const std::string& name,
                                    const std::filesystem::path& folder);

/// The name of the picture between a frame and the one before it (clarus upscale --frame-rate): sorted by name it comes
/// between theirs.
std::string name_before(const std::string& frame);

/// The last part of a path, however it was given: with a slash behind it, as ".".
std::string name_of(const std::filesystem::path& path);

}  // namespace clarus::cli
