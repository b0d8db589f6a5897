#include "clarus/quality.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "base/error.h"

namespace clarus {
namespace {

struct Mode {
    std::string_view name;
    double scale;
};
constexpr std::array kModes{Mode{"ultra_quality", 1.3}, Mode{"quality", 1.5}, Mode{"balanced", 1.7},
                            Mode{"performance", 2}, Mode{"ultra_performance", 3}};

void check_scale(double scale) {
    if (!(scale >= 1) || !std::isfinite(scale)) fail(ErrorKind::invalid_argument, "scale {}; it must be from 1", scale);
}

}  // namespace

std::vector<std::string> quality_modes() {
    std::vector<std::string> names;
    for (const Mode& mode : kModes) names.emplace_back(mode.name);
    return names;
}

double quality_scale(std::string_view mode) {
    const auto found = std::ranges::find(kModes, mode, &Mode::name);
    if (found != kModes.end()) return found->scale;
    fail(ErrorKind::invalid_argument, "no quality mode is named \"{}\"; there are: {}", mode,
         fmt::join(quality_modes(), ", "));
}

Size quality_render_size(Size output, double scale) {
    check_scale(scale);
    if (output.width < 1 || output.height < 1)
        fail(ErrorKind::invalid_argument, "output size {}x{}; each side must be from 1", output.width, output.height);
    const auto side = [&](int pixels) { return std::max(1, static_cast<int>(std::lround(pixels / scale))); };
    return {side(output.width), side(output.height)};
}

int jitter_count(double scale) {
    check_scale(scale);
    return static_cast<int>(std::lround(8 * scale * scale));
}

double mip_bias(double scale) {
    check_scale(scale);
    return 0 - std::log2(scale);  // 0 at scale 1, not −0
}

}  // namespace clarus
