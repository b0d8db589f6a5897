#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "io/sequence.h"

namespace clarus::io {

/// In small letters: ".png".
std::string extension_of(const std::filesystem::path& path);

/// The images directly in a folder by their names without extension. Errors: file where it is no folder, holds no
/// image, or two of one name.
std::map<std::string, std::filesystem::path> images_in(const std::filesystem::path& folder);

/// Whether a path is an image's, by its extension, or a folder's with images directly in it.
bool holds_images(const std::filesystem::path& path);

/// docs/formats.md, "Images alone". Frames are named as the images are. Errors: file, where there is no image, two
/// are of one name, or of different colour spaces.
Sequence read_images(const std::filesystem::path& path, double scale);

}  // namespace clarus::io
