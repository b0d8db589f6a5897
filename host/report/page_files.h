#pragma once

#include <span>
#include <string_view>

namespace clarus::report {

/// The report's page, or what stands in it as {{NAME}}, as it was when the program was built.
struct PageFile {
    std::string_view name;  // "page.html", "page.css", "draw.js"
    std::string_view text;
};

std::span<const PageFile> page_files();

}  // namespace clarus::report
