#include "cl/kernel_source.h"

#include "base/error.h"
#include "kernel_sources.h"

namespace clarus::ocl {

std::string_view kernel_file(std::string_view name) {
    for (const KernelFile& file : kernel_files())
        if (file.name == name) return file.text;
    fail(ErrorKind::invalid_argument, "there is no kernel file '{}'", name);
}

// The #line directives make the compiler's messages name the file that a person can open.
std::string with_common(std::string_view name, std::string_view source) {
    return fmt::format("#line 1 \"common.clh\"\n{}\n#line 1 \"{}\"\n{}", kernel_file("common.clh"), name, source);
}

}  // namespace clarus::ocl
