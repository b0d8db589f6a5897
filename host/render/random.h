#pragma once

#include <cstdint>

namespace clarus::render {

/// splitmix64. The standard library's distributions differ between implementations; a scene must not.
class Random {
  public:
    explicit Random(uint64_t seed) : state_(seed) {}

    uint64_t bits() {
        uint64_t z = state_ += 0x9e3779b97f4a7c15u;
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
        return z ^ (z >> 31);
    }
    /// In [0, 1).
    double uniform() { return static_cast<double>(bits() >> 11) * 0x1p-53; }
    double uniform(double low, double high) { return low + (high - low) * uniform(); }
    /// In 0 … count − 1.
    int below(int count) { return static_cast<int>(bits() % static_cast<uint64_t>(count)); }

  private:
    uint64_t state_;
};

}  // namespace clarus::render
