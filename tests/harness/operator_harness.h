#pragma once

#include <algorithm>
#include <functional>
#include <random>
#include <vector>

#include "cl/context.h"
#include "runtime/frame_constants.h"
#include "runtime/implementation.h"

namespace clarus::test {

/// An image's elements, channel by channel, each row by row.
struct Planes {
    graph::Shape shape;
    std::vector<float> values;

    float& at(int channel, int x, int y) { return values[index(channel, x, y)]; }
    float at(int channel, int x, int y) const { return values[index(channel, x, y)]; }

  private:
    size_t index(int channel, int x, int y) const {
        return (static_cast<size_t>(channel) * shape.height + y) * shape.width + x;
    }
};

/// Outside the image, its nearest pixel.
inline float clamped(const Planes& image, int channel, int x, int y) {
    return image.at(channel, std::clamp(x, 0, image.shape.width - 1), std::clamp(y, 0, image.shape.height - 1));
}

Planes planes(graph::Shape shape, const std::function<float(int channel, int x, int y)>& value);
Planes random_planes(graph::Shape shape, std::mt19937& random, float low = 0, float high = 1);
/// What is left of the values once they have been stored.
Planes rounded(Planes image, runtime::Storage storage);

/// Pixels one after another.
runtime::TensorLayout pixel_layout(graph::Shape shape, runtime::Storage storage);
/// A part of cells of `stride` elements, at `offset`, which hold a block × block square of pixels each.
runtime::TensorLayout part_layout(graph::Shape shape, runtime::Storage storage, int block, int stride, int offset);

/// A buffer with room for a layout and for vector loads past its end. All of it that is not the image is garbage. Of a
/// zero-upsampled image, the samples.
cl::Buffer upload(ocl::Context& context, const runtime::TensorLayout& layout, const Planes* image = nullptr);
/// The image in a buffer of upload(). Checks that what is not the image is as it was.
Planes download(ocl::Context& context, const runtime::TensorLayout& layout, const cl::Buffer& buffer);

/// The result of a problem on the test's device.
Planes run_operator(const runtime::Problem& problem, const runtime::Implementation& implementation,
                    const runtime::Choices& choices, const std::vector<Planes>& inputs,
                    const runtime::FrameConstants& frame, int parameter_set = 0);

/// Makes the checks that `body` asks for once it has returned, with their kernels compiled as one program: to begin
/// a program takes a compiler longer than most kernels. What a check refers to must outlive the outermost call.
void check_together(const std::function<void()>& body);

/// Passes the result of run_operator() to `check`; within check_together(), later.
void check_result(const runtime::Problem& problem, const runtime::Implementation& implementation,
                  const runtime::Choices& choices, const std::vector<Planes>& inputs,
                  const runtime::FrameConstants& frame, int parameter_set,
                  const std::function<void(const Planes& result)>& check);

/// Checks every element against `expected`, to within tolerance · max(1, |expected|). NaN equals NaN only.
void check_close(const Planes& result, const Planes& expected, float tolerance);

/// Runs a problem by every implementation that can run it on the test's device, with each of its choices, and checks
/// the results.
void check_operator(const runtime::Problem& problem, const std::vector<Planes>& inputs,
                    const runtime::FrameConstants& frame, const Planes& expected, float tolerance,
                    int parameter_set = 0);

struct Rows {
    int first, end;
};
/// Which rows of what is stored of an input rows [first, end) of the result read.
using RowsRead = std::function<Rows(int input, int first, int end)>;

/// Checks that every implementation with each of its choices makes of bands of rows what the obvious one makes of whole
/// images, when rings hold no more than one band reads and makes. Inputs and result are pixels of one block.
void check_bands(const runtime::Problem& problem, const std::vector<Planes>& inputs,
                 const runtime::FrameConstants& frame, const RowsRead& read, float tolerance);

/// What storing a value rounds away, for values up to 1.
inline float storage_tolerance(runtime::Storage storage) { return storage == runtime::Storage::f16 ? 1e-3f : 2e-6f; }

}  // namespace clarus::test
