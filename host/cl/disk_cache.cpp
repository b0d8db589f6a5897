#include "cl/disk_cache.h"

#include <fmt/format.h>
#include <xxhash.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <mutex>
#include <set>
#include <span>
#include <string>

#include "base/log.h"
#include "base/output_file.h"
#include "base/private_files.h"
#include "clarus/device.h"
#include "clarus/error.h"

namespace clarus::ocl {
namespace {

constexpr std::array<char, 8> magic = {'C', 'L', 'A', 'R', 'U', 'S', 'C', '2'};

struct Header {
    std::array<char, 8> magic;
    CacheKey key;
    std::uint64_t length;  // of what follows, in bytes
    std::uint64_t hash;    // XXH3-64 of the key and what follows: another key's entry is none of this one's
};
static_assert(sizeof(Header) == 40);

constexpr size_t kLargestEntry = size_t{1} << 28;  // bytes

std::uint64_t checksum(const CacheKey& key, std::span<const unsigned char> payload) {
    std::uint64_t seed = 0;
    for (const unsigned char byte : key) seed = seed * 0x100000001b3 + byte;
    return XXH3_64bits_withSeed(payload.data(), payload.size(), seed);
}

void write_entry(const std::filesystem::path& path, const Header& header, const std::vector<unsigned char>& payload) {
    OutputFile file(path);
    file.write(std::as_bytes(std::span(&header, 1)));
    file.write(std::as_bytes(std::span(payload)));
    file.commit();
}

void warn_once(const std::filesystem::path& folder, std::string_view cause) {
    static std::mutex mutex;
    static std::set<std::filesystem::path> warned;
    {
        const std::lock_guard lock(mutex);
        if (!warned.insert(folder).second) return;
    }
    log(LogLevel::warning,
        "{}. Kernels will be compiled at every start; CLARUS_CACHE_DIR names another folder to keep them in", cause);
}

}  // namespace

std::filesystem::path DiskCache::path(const CacheKey& key) const { return folder_ / hexadecimal(key); }

std::optional<std::vector<unsigned char>> DiskCache::load(const CacheKey& key) const {
    std::error_code none;
    if (folder_.empty() || !std::filesystem::exists(std::filesystem::symlink_status(path(key), none)))
        return std::nullopt;
    const std::optional<std::string> bytes = read_private_file(path(key), kLargestEntry);
    Header header;
    if (bytes && bytes->size() >= sizeof header) {
        std::memcpy(&header, bytes->data(), sizeof header);
        const std::vector<unsigned char> payload(bytes->begin() + sizeof header, bytes->end());
        if (header.magic == magic && header.key == key && header.length == payload.size() &&
            header.hash == checksum(key, payload))
            return payload;
    }
    log(LogLevel::debug, "the cache entry {} is damaged, or others may write it; it is made anew", path(key).string());
    return std::nullopt;
}

void DiskCache::store(const CacheKey& key, const std::vector<unsigned char>& payload) const {
    if (folder_.empty() || sizeof(Header) + payload.size() > kLargestEntry) return;
    if (!make_private_folder(folder_))
        return warn_once(folder_, fmt::format("cannot write to the cache folder {}, which must be your own, and where "
                                              "nobody else may write",
                                              folder_.string()));
    try {
        write_entry(path(key), {magic, key, payload.size(), checksum(key, payload)}, payload);
    } catch (const Error& error) {
        warn_once(folder_, error.what());
    }
}

std::filesystem::path programs_directory() {
    const std::filesystem::path folder = cache_directory();
    return folder.empty() ? folder : folder / "programs";
}

}  // namespace clarus::ocl
