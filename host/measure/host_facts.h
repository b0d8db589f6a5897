#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace clarus::measure {

/// What the system lets one read of the machine that a run is on.
struct HostFacts {
    std::optional<std::string> cpu;
    int cores = 1;                   // logical ones
    std::optional<uint64_t> memory;  // bytes
    std::optional<std::string> os;   // "Debian GNU/Linux 12 (bookworm)"
    std::string kernel;              // "Linux 6.1.0 x86_64"
    std::optional<std::string> governor;
    std::optional<double> load_average;  // over the last minute
};
HostFacts host_facts();

/// Mean of all cores at the moment.
std::optional<double> clock_mhz();

}  // namespace clarus::measure
