#pragma once

namespace clarus {

// Of values from 0, by values from 1.
constexpr int ceil_divide(int value, int by) { return (value + by - 1) / by; }
constexpr int round_up(int value, int to) { return ceil_divide(value, to) * to; }

}  // namespace clarus
