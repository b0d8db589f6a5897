#pragma once

#include <filesystem>
#include <pugixml.hpp>
#include <string>

namespace clarus::render {

// TORCS' descriptions: sections that have a name, and attributes of numbers (attnum) and texts (attstr) in them.

/// The file's outermost section. Errors: file.
pugi::xml_document read_torcs_file(const std::filesystem::path& path);

pugi::xml_node section(pugi::xml_node parent, const char* name);
/// In metres or radians, where the file has another unit.
double number(pugi::xml_node section, const char* name, double otherwise);
std::string text(pugi::xml_node section, const char* name);

}  // namespace clarus::render
