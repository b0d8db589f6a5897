#include "base/explain.h"

#include <filesystem>
#include <new>
#include <system_error>

namespace clarus {

std::string explain(const std::exception& error) {
    if (dynamic_cast<const std::bad_alloc*>(&error)) return "out of host memory";
    const auto* const system = dynamic_cast<const std::system_error*>(&error);
    if (system && system->code() == std::errc::resource_unavailable_try_again)
        return "the system lets no more threads begin (ulimit -u)";
    if (const auto* const file = dynamic_cast<const std::filesystem::filesystem_error*>(&error))
        return (file->path1().empty() ? "a file" : file->path1().string()) + ": " + file->code().message();
    return error.what();
}

}  // namespace clarus
