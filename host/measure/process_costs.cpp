#include "measure/process_costs.h"

#include <fmt/format.h>

#include <ctime>
#include <fstream>
#include <string>

namespace clarus::measure {

double processor_seconds(pid_t process) {
    clockid_t clock;
    timespec time;
    if (clock_getcpuclockid(process, &clock) != 0 || clock_gettime(clock, &time) != 0) return 0;
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

size_t occupied_bytes(pid_t process) {
    std::ifstream rollup(fmt::format("/proc/{}/smaps_rollup", process));
    for (std::string word; rollup >> word;) {
        size_t kibibytes = 0;
        if (word == "Pss:" && rollup >> kibibytes) return kibibytes << 10;
    }
    return 0;
}

}  // namespace clarus::measure
