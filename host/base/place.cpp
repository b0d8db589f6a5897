#include "base/place.h"

#include <dlfcn.h>
#include <link.h>

namespace clarus {
namespace {

namespace fs = std::filesystem;

struct Object {
    fs::path folder;
    bool is_program;
};

/// What this code is linked into. The loader names the program by "".
Object own_object() {
    Dl_info symbol{};
    void* map = nullptr;
    static const int anything_in_it = 0;
    std::error_code error;
    if (dladdr1(&anything_in_it, &symbol, &map, RTLD_DL_LINKMAP) != 0 && map) {
        const fs::path library = static_cast<const link_map*>(map)->l_name;
        if (!library.empty()) return {fs::canonical(library, error).parent_path(), false};
    }
    return {fs::read_symlink("/proc/self/exe", error).parent_path(), true};
}

}  // namespace

fs::path data_folder() {
    const Object own = own_object();
    const fs::path beside = own.folder / (own.is_program ? CLARUS_DATA_FROM_PROGRAM : CLARUS_DATA_FROM_LIBRARY);
    std::error_code error;
    const bool is_there = !own.folder.empty() && fs::is_directory(beside, error);
    return is_there ? beside.lexically_normal() : fs::path(CLARUS_DATA_FOLDER);
}

}  // namespace clarus
