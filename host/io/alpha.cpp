#include "io/alpha.h"

#include <utility>

namespace clarus::io {

Pixels take_alpha(Pixels& color) {
    if (color.channels != 4) return {};
    Pixels alpha{color.size, 1, {}}, rest{color.size, 3, {}};
    alpha.values.reserve(color.values.size() / 4);
    rest.values.reserve(color.values.size() / 4 * 3);
    for (size_t i = 0; i < color.values.size(); i += 4) {
        rest.values.insert(rest.values.end(), &color.values[i], &color.values[i] + 3);
        alpha.values.push_back(color.values[i + 3]);
    }
    color = std::move(rest);
    return alpha;
}

Pixels with_alpha(const Pixels& color, const Pixels& alpha) {
    Pixels result{color.size, 4, {}};
    const size_t pixels = color.values.size() / 3;
    result.values.reserve(4 * pixels);
    for (size_t i = 0; i < pixels; ++i) {
        result.values.insert(result.values.end(), &color.values[3 * i], &color.values[3 * i] + 3);
        result.values.push_back(alpha.values.empty() ? 1 : alpha.values[i]);
    }
    return result;
}

}  // namespace clarus::io
