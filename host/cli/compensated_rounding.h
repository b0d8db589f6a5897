#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace clarus::cli {

/// Rounds weights one after the other, each time changing those that are left so that what is lost least changes the
/// products with what is read (Frantar et al. 2023, "OPTQ"): far less is lost than by rounding each by itself, because
/// neighbouring pixels, and channels, are much alike.
class CompensatedRounding {
  public:
    /// `patches` [count][size]: some of what the weights of an output channel are multiplied with. `columns`: those of
    /// each patch that belong to the weights, from `first` on.
    CompensatedRounding(std::span<const float> patches, size_t size, size_t first, size_t columns);

    /// Whole numbers from −most to most that times `scale` stand for the weights, one for each column.
    std::vector<std::int8_t> round(std::span<const float> weights, double scale, int most) const;

    /// What the products' mean square changes by.
    double error(std::span<const float> weights, std::span<const std::int8_t> rounded, double scale) const;

  private:
    size_t size_;
    std::vector<double> squares_;  // mean products of columns
    std::vector<double> factor_;   // upper triangle U where the squares' inverse is Uᵀ U
};

}  // namespace clarus::cli
