#include "cli/output_folder.h"

#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <ranges>
#include <string>
#include <system_error>

#include "base/error.h"

namespace clarus::cli {

OutputFolders::~OutputFolders() {
    std::error_code not_empty;
    for (const std::filesystem::path& folder : made_ | std::views::reverse) std::filesystem::remove(folder, not_empty);
}

void OutputFolders::require(const std::filesystem::path& folder, uintmax_t bytes) {
    std::error_code error;
    std::filesystem::path part;
    for (const std::filesystem::path& name : folder) {
        part /= name;
        if (std::filesystem::is_directory(part, error)) continue;
        if (std::filesystem::create_directory(part, error)) made_.push_back(part);
        if (error) fail(ErrorKind::file, "cannot make the folder {}: {}", folder.string(), error.message());
    }

    std::string probe = (folder / ".clarus-XXXXXX").string();
    const int file = mkstemp(probe.data());
    if (file < 0)
        fail(ErrorKind::file, "cannot write into {}: {}", folder.string(), std::generic_category().message(errno));
    close(file);
    unlink(probe.c_str());

    const std::filesystem::space_info space = std::filesystem::space(folder, error);
    if (!error && space.available < bytes)
        fail(ErrorKind::file, "no space left in {}: {} bytes are free, and one frame may take {}", folder.string(),
             space.available, bytes);
}

}  // namespace clarus::cli
