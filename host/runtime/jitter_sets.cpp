#include "runtime/jitter_sets.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace clarus::runtime {
namespace {

constexpr double kSameJitter = 0.001;  // render pixels

double distance(Vec2 a, Vec2 b) { return std::hypot(double(a.x) - b.x, double(a.y) - b.y); }

}  // namespace

JitterSets::JitterSets(std::vector<Vec2> table, int computed) : table_(std::move(table)), computed_(computed) {}

JitterSets::Selection JitterSets::select(Vec2 jitter) {
    const auto nearest = std::min_element(table_.begin(), table_.end(),
                                          [&](Vec2 a, Vec2 b) { return distance(a, jitter) < distance(b, jitter); });
    const int entry = static_cast<int>(nearest - table_.begin());
    if (nearest != table_.end()) {
        const double away = distance(*nearest, jitter);
        if (away <= kSameJitter) return {entry, false};
        if (computed_.empty()) {
            largest_distance_ = std::max(largest_distance_, away);
            return {entry, false};
        }
    }

    ++clock_;
    const int first = static_cast<int>(table_.size());
    for (Computed& computed : computed_) {
        if (computed.last_used == 0 || computed.jitter != jitter) continue;
        computed.last_used = clock_;
        return {first + static_cast<int>(&computed - computed_.data()), false};
    }
    const auto oldest = std::min_element(computed_.begin(), computed_.end(), [](const Computed& a, const Computed& b) {
        return a.last_used < b.last_used;
    });
    *oldest = {jitter, clock_};
    return {first + static_cast<int>(oldest - computed_.begin()), true};
}

void JitterSets::forget(int set) { computed_[set - table_.size()] = {}; }

}  // namespace clarus::runtime
