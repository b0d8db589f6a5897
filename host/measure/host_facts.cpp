#include "measure/host_facts.h"

#include <fmt/format.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <numeric>
#include <string_view>
#include <thread>
#include <vector>

namespace clarus::measure {
namespace {

std::optional<std::string> first_line(const std::string& path) {
    std::ifstream file(path);
    std::string line;
    if (!std::getline(file, line)) return std::nullopt;
    return line;
}

/// The values of all lines `key <separator> value` of a system's file.
std::vector<std::string> values_of(const std::string& path, std::string_view key, char separator) {
    std::vector<std::string> values;
    std::ifstream file(path);
    for (std::string line; std::getline(file, line);) {
        const size_t at = line.find(separator);
        if (at == std::string::npos) continue;
        const size_t key_end = line.find_last_not_of(" \t", at - 1), value = line.find_first_not_of(" \t\"", at + 1);
        if (at == 0 || line.substr(0, key_end + 1) != key || value == std::string::npos) continue;
        values.push_back(line.substr(value, line.find_last_not_of(" \t\"") + 1 - value));
    }
    return values;
}

std::optional<std::string> value_of(const std::string& path, std::string_view key, char separator) {
    const std::vector<std::string> values = values_of(path, key, separator);
    if (values.empty()) return std::nullopt;
    return values.front();
}

}  // namespace

HostFacts host_facts() {
    HostFacts facts;
    facts.cpu = value_of("/proc/cpuinfo", "model name", ':');
    facts.cores = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
    if (const long pages = sysconf(_SC_PHYS_PAGES); pages > 0)
        facts.memory = static_cast<uint64_t>(pages) * static_cast<uint64_t>(sysconf(_SC_PAGE_SIZE));
    facts.os = value_of("/etc/os-release", "PRETTY_NAME", '=');
    utsname system{};
    uname(&system);
    facts.kernel = fmt::format("{} {} {}", system.sysname, system.release, system.machine);
    facts.governor = first_line("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor");
    if (double load = 0; getloadavg(&load, 1) == 1) facts.load_average = load;
    return facts;
}

std::optional<double> clock_mhz() {
    std::vector<double> clocks;
    for (const std::string& clock : values_of("/proc/cpuinfo", "cpu MHz", ':'))
        clocks.push_back(std::strtod(clock.c_str(), nullptr));
    if (clocks.empty()) {  // not an x86
        for (int core = 0;; ++core) {
            const auto khz = first_line(fmt::format("/sys/devices/system/cpu/cpu{}/cpufreq/scaling_cur_freq", core));
            if (!khz) break;
            clocks.push_back(1e-3 * std::strtod(khz->c_str(), nullptr));
        }
    }
    if (clocks.empty()) return std::nullopt;
    return std::accumulate(clocks.begin(), clocks.end(), 0.0) / static_cast<double>(clocks.size());
}

}  // namespace clarus::measure
