#include "cl/disk_cache.h"

#include <fmt/format.h>
#include <unistd.h>
#include <xxhash.h>

#include <atomic>
#include <cstring>
#include <fstream>
#include <mutex>
#include <set>

#include "base/log.h"
#include "clarus/device.h"

namespace clarus::ocl {
namespace {

constexpr std::array<char, 8> magic = {'C', 'L', 'A', 'R', 'U', 'S', 'C', '1'};

struct Header {
    std::array<char, 8> magic;
    CacheKey key;
    std::uint64_t length;  // of what follows, in bytes
    std::uint64_t hash;    // of what follows, XXH3-64
};
static_assert(sizeof(Header) == 40);

// Two processes, and two threads of one, write under different names.
std::filesystem::path temporary_name(const std::filesystem::path& path) {
    static std::atomic<unsigned> count = 0;
    std::filesystem::path name = path;
    name += fmt::format(".{}.{}.tmp", getpid(), count++);
    return name;
}

bool write_entry(const std::filesystem::path& path, const Header& header, const std::vector<unsigned char>& payload) {
    std::ofstream file(path, std::ios::binary);
    file.write(reinterpret_cast<const char*>(&header), sizeof header);
    file.write(reinterpret_cast<const char*>(payload.data()), std::streamsize(payload.size()));
    file.close();
    return bool(file);
}

void warn_once(const std::filesystem::path& folder) {
    static std::mutex mutex;
    static std::set<std::filesystem::path> warned;
    {
        const std::lock_guard lock(mutex);
        if (!warned.insert(folder).second) return;
    }
    log(LogLevel::warning,
        "cannot write to the cache folder {}: kernels will be compiled at every start. CLARUS_CACHE_DIR names another "
        "folder",
        folder.string());
}

}  // namespace

CacheKey cache_key(std::initializer_list<std::string_view> parts) {
    std::string joined;
    for (const std::string_view part : parts) {
        joined += fmt::format("{}:", part.size());
        joined += part;
    }
    XXH128_canonical_t canonical;
    XXH128_canonicalFromHash(&canonical, XXH3_128bits(joined.data(), joined.size()));
    CacheKey key;
    std::memcpy(key.data(), canonical.digest, key.size());
    return key;
}

std::filesystem::path DiskCache::path(const CacheKey& key) const {
    std::string name;
    for (const unsigned char byte : key) name += fmt::format("{:02x}", byte);
    return folder_ / name;
}

std::optional<std::vector<unsigned char>> DiskCache::load(const CacheKey& key) const {
    std::error_code error;
    const std::uintmax_t file_size = std::filesystem::file_size(path(key), error);
    if (error) return std::nullopt;

    std::ifstream file(path(key), std::ios::binary);
    Header header;
    if (file.read(reinterpret_cast<char*>(&header), sizeof header) && header.magic == magic && header.key == key &&
        header.length == file_size - sizeof header) {
        std::vector<unsigned char> payload(header.length);
        if (file.read(reinterpret_cast<char*>(payload.data()), std::streamsize(payload.size())) &&
            header.hash == XXH3_64bits(payload.data(), payload.size()))
            return payload;
    }
    log(LogLevel::debug, "the cache entry {} is damaged; it is made anew", path(key).string());
    return std::nullopt;
}

void DiskCache::store(const CacheKey& key, const std::vector<unsigned char>& payload) const {
    const Header header{magic, key, payload.size(), XXH3_64bits(payload.data(), payload.size())};
    const std::filesystem::path temporary = temporary_name(path(key));
    std::error_code error;
    std::filesystem::create_directories(folder_, error);
    bool stored = write_entry(temporary, header, payload);
    if (stored) {
        std::filesystem::rename(temporary, path(key), error);
        stored = !error;
    }
    if (!stored) {
        warn_once(folder_);
        std::filesystem::remove(temporary, error);
    }
}

std::filesystem::path programs_directory() { return std::filesystem::path(cache_directory()) / "programs"; }

}  // namespace clarus::ocl
