#pragma once

#include <fcntl.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string_view>

namespace clarus::faults {

/// What CLARUS_FAULTS="NAME NUMBER CODE" in the environment asks for: the call of that name which is the NUMBER-th,
/// from 1, fails with CODE; with " on" after it all later ones, too.
struct Fault {
    char name[64] = {};
    unsigned long long number = 0;  // 0: none fails
    int code = 0;
    bool goes_on = false;

    bool is_of(const char* call) const { return number != 0 && std::strcmp(name, call) == 0; }
    /// Of the calls of its name.
    bool hits(unsigned long long call) const { return goes_on ? call >= number : call == number; }
};

inline Fault asked_fault() {
    Fault fault;
    char more[4] = {};
    const char* const asked = std::getenv("CLARUS_FAULTS");
    const int fields = asked ? std::sscanf(asked, "%63s %llu %d %3s", fault.name, &fault.number, &fault.code, more) : 0;
    if (fields < 3) return {};
    fault.goes_on = std::strcmp(more, "on") == 0;
    return fault;
}

/// Adds a line, "NAME COUNT", to the file that CLARUS_FAULTS_COUNTS names, if it does.
inline void tell_count(const char* name, unsigned long long count) {
    const char* const path = std::getenv("CLARUS_FAULTS_COUNTS");
    const int file = path ? open(path, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666) : -1;
    if (file < 0) return;
    dprintf(file, "%s %llu\n", name, count);
    close(file);
}

}  // namespace clarus::faults
