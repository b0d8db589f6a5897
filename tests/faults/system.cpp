// What a process asks of the system and fails when a test says so; to be loaded by LD_PRELOAD. Only what Clarus's own
// modules ask for counts, also where they do so by the C++ library: drivers and compilers end the process when memory
// does.
//
// CLARUS_FAULTS (fault.h) names `write` and `fsync` of files that have no name yet, `rename`, `thread`, or an
// allocation by the hash of who asks for it: the innermost of Clarus's callers. CLARUS_FAULTS_COUNTS is told of all of
// them.

#include <dlfcn.h>
#include <link.h>
#include <pthread.h>
#include <unwind.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstdint>
#include <map>
#include <mutex>
#include <new>
#include <string>

#include "fault.h"

extern "C" {
void* __libc_malloc(size_t);
void* __libc_calloc(size_t, size_t);
void* __libc_realloc(void*, size_t);
void* __libc_memalign(size_t, size_t);
}

namespace clarus::faults {
namespace {

enum class Owner { clarus, library, other };  // library: works for whoever calls it

constexpr std::string_view base_name(std::string_view path) { return path.substr(path.rfind('/') + 1); }

struct Place {
    Owner owner = Owner::other;
    std::uint64_t module = 0, offset = 0;  // the same in every process
};

constexpr std::uint64_t mixed(std::uint64_t hash, std::uint64_t value) { return (hash ^ value) * 0x100000001b3; }

Place place_of(void* address) {
    dl_find_object found;
    if (_dl_find_object(address, &found) != 0) return {};
    const std::string_view name = base_name(found.dlfo_link_map->l_name);
    Place place;
    for (const char letter : name) place.module = mixed(place.module, static_cast<unsigned char>(letter));
    place.offset = static_cast<std::uint64_t>(static_cast<char*>(address) - static_cast<char*>(found.dlfo_map_start));
    // The program has no name.
    if (name.empty() || name.starts_with("clarus_") || name.starts_with("libclarus"))
        place.owner = Owner::clarus;
    else if (name.starts_with("libstdc++") || name.starts_with("libfmt") || name.starts_with("libspdlog"))
        place.owner = Owner::library;
    return place;
}

/// Who asks: 0 where that is not Clarus.
struct Caller {
    std::uint64_t hash = 0;
    bool is_clarus = false;
    int frames = 0;
};

_Unwind_Reason_Code look_at(_Unwind_Context* context, void* state) {
    constexpr int kFrames = 5;
    auto& caller = *static_cast<Caller*>(state);
    static const Place own = place_of(reinterpret_cast<void*>(&look_at));
    const Place place = place_of(reinterpret_cast<void*>(_Unwind_GetIP(context)));
    if (place.module == own.module || place.owner == Owner::library) return _URC_NO_REASON;
    if (place.owner == Owner::other) return _URC_END_OF_STACK;
    caller.is_clarus = true;
    caller.hash = mixed(mixed(caller.hash, place.module), place.offset);
    return ++caller.frames < kFrames ? _URC_NO_REASON : _URC_END_OF_STACK;
}

thread_local bool is_looking = false;  // what that allocates is nobody's
std::atomic<bool> has_begun = false, has_ended = false;

Caller caller() {
    Caller found;
    if (!has_begun || has_ended || is_looking) return found;
    is_looking = true;
    _Unwind_Backtrace(look_at, &found);
    is_looking = false;
    return found;
}

const Fault fault = asked_fault();

struct Counts {
    std::mutex mutex;
    std::map<std::string, unsigned long long> of;
    ~Counts() {
        has_ended = true;
        for (const auto& [name, count] : of) tell_count(name.c_str(), count);
    }
} counts;

/// Whether this call fails; errno then says how.
bool fails(const char* name) {
    is_looking = true;
    unsigned long long number;
    {
        const std::lock_guard lock(counts.mutex);
        number = ++counts.of[name];
    }
    is_looking = false;
    if (!fault.is_of(name) || !fault.hits(number)) return false;
    errno = fault.code;
    return true;
}

bool allocation_fails() {
    const Caller asking = caller();
    if (!asking.is_clarus) return false;
    std::array<char, 40> name;
    std::snprintf(name.data(), name.size(), "allocation:%016llx", static_cast<unsigned long long>(asking.hash));
    return fails(name.data());
}

/// Output that is not whole has a name that says so (base/output_file.h).
bool is_unfinished(int file) {
    std::array<char, 64> link;
    std::snprintf(link.data(), link.size(), "/proc/self/fd/%d", file);
    std::array<char, 4096> name;
    const ssize_t length = readlink(link.data(), name.data(), name.size());
    return length > 0 && std::string_view(name.data(), static_cast<size_t>(length)).ends_with(".partial");
}

template <typename Function>
Function* next(const char* name) {
    return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

}  // namespace
}  // namespace clarus::faults

using namespace clarus::faults;

void* operator new(size_t bytes) {
    void* const memory = allocation_fails() ? nullptr : __libc_malloc(bytes);
    if (!memory) throw std::bad_alloc();
    return memory;
}

void* operator new(size_t bytes, std::align_val_t alignment) {
    void* const memory = allocation_fails() ? nullptr : __libc_memalign(static_cast<size_t>(alignment), bytes);
    if (!memory) throw std::bad_alloc();
    return memory;
}

extern "C" {

void* malloc(size_t bytes) { return allocation_fails() ? nullptr : __libc_malloc(bytes); }

void* calloc(size_t count, size_t bytes) { return allocation_fails() ? nullptr : __libc_calloc(count, bytes); }

void* realloc(void* memory, size_t bytes) { return allocation_fails() ? nullptr : __libc_realloc(memory, bytes); }

ssize_t write(int file, const void* bytes, size_t count) {
    static const auto real = next<decltype(write)>("write");
    return is_unfinished(file) && fails("write") ? -1 : real(file, bytes, count);
}

int fsync(int file) {
    static const auto real = next<decltype(fsync)>("fsync");
    return is_unfinished(file) && fails("fsync") ? -1 : real(file);
}

int rename(const char* from, const char* to) noexcept {
    static const auto real = next<decltype(rename)>("rename");
    return caller().is_clarus && fails("rename") ? -1 : real(from, to);
}

int pthread_create(pthread_t* thread, const pthread_attr_t* attributes, void* (*run)(void*), void* argument) noexcept {
    static const auto real = next<decltype(pthread_create)>("pthread_create");
    return caller().is_clarus && fails("thread") ? errno : real(thread, attributes, run, argument);
}

/// Before main, an error would reach nobody.
int __libc_start_main(int (*main)(int, char**, char**), int count, char** words, void (*init)(), void (*fini)(),
                      void (*loader_fini)(), void* stack_end) {
    static decltype(main) programs;
    programs = main;
    const auto real = next<decltype(__libc_start_main)>("__libc_start_main");
    const auto begin = [](int arguments, char** values, char** environment) {
        has_begun = true;
        const int result = programs(arguments, values, environment);
        has_begun = false;
        return result;
    };
    return real(begin, count, words, init, fini, loader_fini, stack_end);
}
}
