#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "clarus/model.h"
#include "clarus/types.h"

namespace clarus::measure {

/// What is kept of an image to recognise it by: in each cell of a grid of 8×8, the sum of all values, each with a sign
/// of its own that only its place decides, over the square root of their number. The difference of two images' sums
/// then has the size of the root mean square difference of their values in the cell, wherever in it they differ.
constexpr int kCells = 8;
using Sketch = std::array<float, kCells * kCells>;

/// `pixels` has three channels.
Sketch sketch(Size size, const std::vector<float>& pixels);

/// The largest of the cells' differences; NaN where a value is none.
double difference(const Sketch& a, const Sketch& b);

/// The largest difference that is not an error: a signal-to-noise ratio of 60 dB in every cell; in half, 40 dB.
double tolerance(Precision precision);

/// XXH3-128 of the model's file in hexadecimal; empty for a filter.
std::string checksum(const Model& model);

/// The last frames of the test sequence as models must show them, by model, scale and render size. A file of these lies
/// in the tree; `clarus bench --write-checks` makes it with the obvious kernels in fp32.
class Checks {
  public:
    /// Errors: file, also where there is none.
    static Checks read(const std::filesystem::path& path);
    /// Errors: file.
    void write(const std::filesystem::path& path) const;

    const Sketch* find(const Model& model, Size render) const;
    /// In place of what was there for this model's name, scale and size.
    void set(const Model& model, Size render, const Sketch& expected);

  private:
    struct Expected {
        std::string checksum;  // of the weights that it is of
        Sketch sketch;
    };
    struct Key {
        std::string model;
        double scale;
        int width, height;  // render size
        auto operator<=>(const Key&) const = default;
    };
    std::map<Key, Expected> expected_;
};

/// Where the checks that come with Clarus are.
std::filesystem::path shipped_checks();

}  // namespace clarus::measure
