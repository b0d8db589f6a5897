#include "render/worlds/torcs_file.h"

#include <numbers>

#include "base/error.h"

namespace clarus::render {

pugi::xml_document read_torcs_file(const std::filesystem::path& path) {
    pugi::xml_document document;
    const pugi::xml_parse_result result = document.load_file(path.c_str());
    if (!result) fail(ErrorKind::file, "cannot read {}: {}", path.string(), result.description());
    return document;
}

pugi::xml_node section(pugi::xml_node parent, const char* name) {
    return parent.find_child_by_attribute("section", "name", name);
}

double number(pugi::xml_node section, const char* name, double otherwise) {
    const pugi::xml_node found = section.find_child_by_attribute("attnum", "name", name);
    if (!found) return otherwise;
    const std::string_view unit = found.attribute("unit").value();
    const double scale = unit == "deg"  ? std::numbers::pi / 180
                         : unit == "ft" ? 0.3048
                         : unit == "in" ? 0.0254
                         : unit == "mm" ? 0.001
                         : unit == "cm" ? 0.01
                                        : 1;
    return found.attribute("val").as_double() * scale;
}

std::string text(pugi::xml_node section, const char* name) {
    return section.find_child_by_attribute("attstr", "name", name).attribute("val").value();
}

}  // namespace clarus::render
