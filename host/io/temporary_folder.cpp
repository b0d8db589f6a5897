#include "io/temporary_folder.h"

#include <system_error>

#include "base/error.h"
#include "base/platform.h"

namespace clarus::io {

TemporaryFolder::TemporaryFolder() {
    std::error_code missing;
    const std::filesystem::path folder = std::filesystem::temp_directory_path(missing);
    if (missing) fail(ErrorKind::file, "TMPDIR names no folder for temporary files: {}", missing.message());
    path_ = make_unique_folder(folder / "clarus-");
}

TemporaryFolder::~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
}

}  // namespace clarus::io
