#include <array>
#include <cstdio>
#include <memory>
#include <regex>

#include "bench/suite.h"

namespace clarus::bench {

double clpeak_peak(const Device& device) {
    // clpeak numbers platforms that have devices; the platform is asked for by its name instead.
    const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen("clpeak --compute-sp 2>/dev/null", "r"), pclose);
    if (!pipe) return 0;
    std::array<char, 256> line{};
    bool on_device = false;
    double most = 0;
    const std::regex figure(R"(^\s*float\d*\s*:\s*([0-9.]+))");
    while (std::fgets(line.data(), line.size(), pipe.get())) {
        const std::string text = line.data();
        if (text.find("Device: ") != std::string::npos)
            on_device = text.find(device.profile().name) != std::string::npos;
        std::smatch match;
        if (on_device && std::regex_search(text, match, figure)) most = std::max(most, 1e9 * std::stod(match[1]));
    }
    return most;
}

}  // namespace clarus::bench
