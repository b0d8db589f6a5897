#include "cl/kernel_source.h"

#include <algorithm>

#include "base/error.h"
#include "kernel_sources.h"

namespace clarus::ocl {

std::string_view kernel_file(std::string_view name) {
    for (const KernelFile& file : kernel_files())
        if (file.name == name) return file.text;
    fail(ErrorKind::invalid_argument, "there is no kernel file '{}'", name);
}

namespace {

/// `text` with the files that its lines `#include "…"` name in their places.
std::string with_included(std::string_view name, std::string_view text) {
    constexpr std::string_view kInclude = "#include \"";
    std::string result = fmt::format("#line 1 \"{}\"\n", name);
    for (int line = 1; !text.empty(); ++line) {
        const size_t end = std::min(text.find('\n'), text.size() - 1) + 1;
        const std::string_view each = text.substr(0, end);
        text.remove_prefix(end);
        if (!each.starts_with(kInclude)) {
            result += each;
            continue;
        }
        const std::string_view included = each.substr(kInclude.size(), each.rfind('"') - kInclude.size());
        result += fmt::format("{}\n#line {} \"{}\"\n", with_included(included, kernel_file(included)), line + 1, name);
    }
    return result;
}

}  // namespace

// The #line directives make the compiler's messages name the file that a person can open.
std::string with_common(std::string_view name, std::string_view source) {
    return with_included("common.clh", kernel_file("common.clh")) + with_included(name, source);
}

}  // namespace clarus::ocl
