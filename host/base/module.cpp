#include "base/module.h"

#include <dlfcn.h>

#include <filesystem>

#include "base/error.h"

namespace clarus {

void* find_module_function(const char* module, const char* function) {
    // In the build tree as where it is installed, the folder is where it is as seen from the program's.
    static const std::filesystem::path folder =
        std::filesystem::read_symlink("/proc/self/exe").parent_path() / CLARUS_MODULE_FOLDER;
    void* const handle = dlopen((folder / module += ".so").lexically_normal().c_str(), RTLD_LAZY | RTLD_LOCAL);
    if (!handle) fail(ErrorKind::file, "cannot load a part of clarus: {}", dlerror());
    void* const address = dlsym(handle, function);
    if (!address) fail(ErrorKind::file, "{} is of another version of clarus: {}", module, dlerror());
    return address;
}

}  // namespace clarus
