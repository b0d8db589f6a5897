#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>

/// Sets CLARUS_CACHE_DIR as long as it lives.
class CacheFolder {
  public:
    explicit CacheFolder(const std::filesystem::path& path) : before_(variable()) {
        setenv("CLARUS_CACHE_DIR", path.c_str(), 1);
    }
    ~CacheFolder() {
        if (before_.empty())
            unsetenv("CLARUS_CACHE_DIR");
        else
            setenv("CLARUS_CACHE_DIR", before_.c_str(), 1);
    }
    CacheFolder(const CacheFolder&) = delete;
    CacheFolder& operator=(const CacheFolder&) = delete;

  private:
    static std::string variable() {
        const char* value = std::getenv("CLARUS_CACHE_DIR");
        return value ? value : "";
    }
    std::string before_;
};
