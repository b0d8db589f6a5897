#include "io/temporary_folder.h"

#include <stdlib.h>

#include <cerrno>
#include <string>
#include <system_error>

#include "base/error.h"

namespace clarus::io {

TemporaryFolder::TemporaryFolder() {
    std::error_code missing;
    const std::filesystem::path folder = std::filesystem::temp_directory_path(missing);
    if (missing) fail(ErrorKind::file, "TMPDIR names no folder for temporary files: {}", missing.message());
    std::string name = (folder / "clarus-XXXXXX").string();
    if (!mkdtemp(name.data())) {
        fail(ErrorKind::file, "cannot make a temporary folder {}: {}", name, std::generic_category().message(errno));
    }
    path_ = name;
}

TemporaryFolder::~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
}

}  // namespace clarus::io
