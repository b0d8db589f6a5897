#pragma once

#include <array>
#include <optional>
#include <variant>
#include <vector>

#include "base/rounding.h"
#include "graph/quantization.h"
#include "graph/traits.h"

/// The operators of docs/pipelines.md, "Operators", as plain data. An operator's inputs, in order, and its result are
/// documented here; the definitions are there.
namespace clarus::graph {

enum class Resource { color, depth, motion, reactive_mask, transparency_mask, opaque_color, ui, alpha };
inline constexpr std::array kResources{
    Resource::color,        Resource::depth, Resource::motion, Resource::reactive_mask, Resource::transparency_mask,
    Resource::opaque_color, Resource::ui,    Resource::alpha};

/// A resource of the frame description, converted to its canonical form: at render resolution colour and opaque colour
/// (3 channels, display-encoded), depth (1), motion (2, render pixels, NaN where invalid), a mask (1, from 0 to 1) or
/// alpha (1, from 0 to 1: the fourth component of the image of colour); at output resolution the user interface (4,
/// from 0 to 1, premultiplied).
struct Input {
    Resource resource;
    Traits traits() const {
        const bool precise = resource == Resource::depth || resource == Resource::motion;
        return {Memory::ingested, precise ? Stored::f32 : Stored::image, Pixels::all, kAnyRows, 0};
    }
};

enum class FrameScalar { jitter_x, jitter_y, scale };

/// A plane that holds a number of the frame's everywhere.
struct Plane {
    FrameScalar scalar;
    Traits traits() const { return {Memory::ingested, Stored::image, Pixels::all, kAnyRows, 0}; }
};

/// Last frame's value of a state; zero before the first. Which value it becomes: Graph::carry.
struct Previous {
    Traits traits() const { return {Memory::previous, Stored::as_input, Pixels::all, kAnyRows, 0}; }
};

/// What another part of the network has made (graph/partition.h), in this frame or in one before.
struct Import {
    int port;  // which of the part's imports
    int frames_ago;
    Stored stored;
    Traits traits() const { return {Memory::imported, stored, Pixels::all, kAnyRows, 0}; }
};

/// Which jitter shifts the source grid of an upsampling: none, the frame's J, or J_m of the motion vectors.
enum class Shift { none, jitter, motion_jitter };

/// upsample(x, s, J). Input: image.
struct Upsample {
    int scale;
    Shift shift;
    // Operations: four products, three sums.
    Traits traits() const { return {Memory::own, Stored::feature, Pixels::all, rows_of_upsampling, 7}; }
};

/// s · upsample(m, s, J_m). Input: motion. Result: 2 channels in HR pixels, NaN where an invalid vector counts: one of
/// the four taps whose weight along each axis exceeds 10⁻³.
struct UpsampleMotion {
    int scale;
    // Operations: as Upsample.
    Traits traits() const { return {Memory::own, Stored::f32, Pixels::all, kAnyRows, 7}; }
};

/// Filters without a network (pipelines/filters/README.md).
enum class Filter { nearest, bilinear, bicubic, lanczos };
double operations_an_element(Filter filter);

/// An image by a filter at any real scale above 0; below 1 nothing is averaged. Input: an image, of values in [0, 1]
/// where the result is clamped to that.
struct Resample {
    Filter filter;
    double scale;
    Shift shift = Shift::jitter;
    bool clamped = true;
    Traits traits() const { return {Memory::own, Stored::image, Pixels::all, kAnyRows, operations_an_element(filter)}; }
};

/// An image as it would be shown, in [0, 1], at another size, each axis at a ratio of its own: enlarged by Keys'
/// bicubic without overshoot, or reduced to the mean of what each pixel covers. Input: an image. Result: up to
/// kMostFitRatio times as large along an axis, or as small.
struct Fit {
    Traits traits() const { return {Memory::own, Stored::image, Pixels::all, kAnyRows, operations_of_fit}; }
};
inline constexpr int kMostFitRatio = 4;

/// EASU, the first pass of FSR 1, at any real scale, aware of the jitter. Input: colour.
struct Easu {
    double scale;
    // Operations: of it, 12 weights at 19 serve 3 channels.
    Traits traits() const { return {Memory::own, Stored::image, Pixels::all, kAnyRows, 110}; }
};

/// RCAS, the second pass of FSR 1, its lobe times `sharpness`. Input: colour.
struct Rcas {
    float sharpness;
    Traits traits() const { return {Memory::own, Stored::image, Pixels::all, kAnyRows, 22}; }
};

inline constexpr int kDilationBlock = 8;
/// dilate(m, d, s). Inputs: motion, depth. Result: 2 channels, one vector (in HR pixels) for each 8×8 block.
struct Dilate {
    int scale;
    Traits traits() const {
        const int side = ceil_divide(kDilationBlock, scale);
        const double nearest_of_block = side * side - 1;  // for two elements, with a product each
        return {Memory::own, Stored::f32, Pixels::all, kAnyRows, nearest_of_block / 2 + 1};
    }
};

enum class Border { clamp, zero };

/// warp(I, M, border, fallback). Inputs: image, motion in HR pixels (one vector for each block of `motion_block`
/// squared pixels, NaN where invalid), and the image that gives the fallback: itself where it has the warped image's
/// size, else upsample(fallback, s, J) of a render-resolution one; channels it lacks are 0, as is all of it where there
/// is no such input. On a reset frame all is fallback.
struct Warp {
    Border border;
    int motion_block;
    int fallback_scale;
    // Operations: as Upsample.
    Traits traits() const { return {Memory::own, Stored::feature, Pixels::samples, kAnyRows, 7}; }
};

/// A plane that is `value` everywhere, stored as float.
struct Fill {
    float value;
    Traits traits() const { return {Memory::own, Stored::f32, Pixels::all, kAnyRows, 0}; }
};

// Checked history and held range: docs/history.md.

/// depth_before(m, d). Inputs: motion, depth. Result: 1 channel at render resolution, from 0 to 1, stored as float.
struct DepthBefore {
    // Operations: depths' differences and the choice of a neighbour 10, vectors' 8, the area 5, its root and
    // product 11.
    Traits traits() const { return {Memory::own, Stored::f32, Pixels::all, kAnyRows, 34}; }
};

/// previous_depth(m, d), or landed_depth(m, d) of docs/interpolate.md, which is that at a `share` of the way to the
/// previous frame. Inputs: a plane of ones, in whose place the result is written (Graph::previous_depth), motion,
/// depth. Result: 1 channel at render resolution, stored as float, the same whatever the order in which pixels are
/// seen.
struct PreviousDepth {
    float share = 1;
    // Operations: where it lands 12, four weights 6, two comparisons for each.
    Traits traits() const { return {Memory::in_place, Stored::f32, Pixels::all, kAnyRows, 26}; }
};

/// checked_motion(m, d, P). Inputs: motion, depth, previous depth. Result: 2 channels at render resolution, NaN where
/// there is no history.
struct CheckedMotion {
    // Operations: of 224 a pixel: nine companions 36, to which and to 25 neighbours four pixels are compared 136,
    // depths 34, weights 18.
    Traits traits() const { return {Memory::own, Stored::f32, Pixels::all, kAnyRows, 112}; }
};

/// validity(m). Input: motion. Result: 1 channel, 0 everywhere in a reset frame.
struct Validity {
    Traits traits() const { return {Memory::own, Stored::image, Pixels::all, kAnyRows, 2}; }
};

/// reproject(m, d, s) at any real scale from 1, aware of J_m. Inputs: motion, depth. Result: 2 channels in HR pixels,
/// NaN where there is no history.
struct Reproject {
    double scale;
    // Operations: as Upsample.
    Traits traits() const { return {Memory::own, Stored::f32, Pixels::all, kAnyRows, 7}; }
};

/// What `hold` confines colours to. Inputs: colour, HR history, of whose channels the first three count. Result, at
/// render resolution: the least (channels 0–2) and the greatest (3–5) of the 3×3 pixels of colour around each, and 1
/// where the history is outside of them, else 0 (6).
struct Range {
    int scale;
    Traits traits() const { return {Memory::own, Stored::image, Pixels::all, kAnyRows, 4}; }
};
/// 1 where the history of most of the pixels around is inside its range, else 0. Input: a Range's result.
struct Believed {
    Traits traits() const { return {Memory::own, Stored::image, Pixels::all, kAnyRows, 10}; }
};

// The frame between two: docs/interpolate.md.

/// landed_source(m, d, L). Inputs: a plane of kNoSource, in whose place the result is written (Graph::landed_source),
/// motion, depth, landed depth. Result: 1 channel at render resolution, stored as float: numbers of pixels, row by row.
struct LandedSource {
    float share;
    // Operations: as PreviousDepth, three comparisons for each weight.
    Traits traits() const { return {Memory::in_place, Stored::f32, Pixels::all, kAnyRows, 30}; }
};
/// Beyond the number of any pixel; whole numbers up to it are floats.
inline constexpr int kNoSource = 1 << 24;

/// middle_motion(m, d, S). Inputs: motion, depth, landed source. Result: kMiddle channels at render resolution, stored
/// as float: motion, depth, and who shows the pixel, this frame (0), the previous one (1), or nobody knows (½).
struct MiddleMotion {
    // Operations: nine comparisons a pixel where no hole is near.
    Traits traits() const { return {Memory::own, Stored::f32, Pixels::all, kAnyRows, 2.25}; }
};
inline constexpr int kMiddle = 4;

/// between(M, I, I') at any real scale from 1; I in a reset frame. Inputs: middle motion, this frame's colour at output
/// resolution, the previous frame's.
struct Between {
    double scale;
    // Operations: twenty taps of two images, seven for both.
    Traits traits() const { return {Memory::own, Stored::image, Pixels::all, kAnyRows, 47}; }
};

// FSR 2's class of upscaler: docs/fsr2.md. History is 4 channels HR: colour and the weight of the samples in it.

/// warp_sharply(history, M), and upsample(colour, s, J) of weight 0 where M is invalid and all over a reset frame; any
/// real scale from 1. Inputs: history, motion in HR pixels (a vector for each), colour.
struct WarpSharply {
    double scale;
    // Operations: twelve taps.
    Traits traits() const { return {Memory::own, Stored::image, Pixels::all, kAnyRows, 25}; }
};

/// residual(colour, past, J) at any real scale. Inputs: colour, past. Result: 3 channels at render resolution, in
/// YCoCg.
struct Residual {
    // Operations: a look-up, two conversions.
    Traits traits() const { return {Memory::own, Stored::image, Pixels::all, kAnyRows, 14}; }
};
/// trust(D, c, s) at any real scale. Inputs: residual, checked motion. Result: 1 channel at render resolution, from 0
/// to 1.
struct Trust {
    double scale;
    // Operations: 10 columns' sums of 3 channels, 40 more.
    Traits traits() const { return {Memory::own, Stored::image, Pixels::all, kAnyRows, 140}; }
};
/// collect(colour, past, t, M, s, J) at any real scale from 1. Inputs: colour, past, trust, motion in HR pixels (a
/// vector for each). Result: the new history.
struct Collect {
    double scale;
    // Operations: nine taps at 24, 44 for what follows.
    Traits traits() const { return {Memory::own, Stored::image, Pixels::all, kAnyRows, 65}; }
};

/// pick(I, s, J). Input: HR image. Result: its pixels at the frame's sample position, at render resolution.
struct Pick {
    int scale;
    Traits traits() const { return {Memory::own, Stored::image, Pixels::all, kAnyRows, 0}; }
};
/// place(I, x, s, J). Inputs: HR image, LR samples of as many channels.
struct Place {
    int scale;
    Traits traits() const { return {Memory::in_place, Stored::image, Pixels::all, kAnyRows, 0}; }
};
/// avgpool_s. Input: image.
struct AveragePool {
    int scale;
    Traits traits() const { return {Memory::own, Stored::image, Pixels::all, kAnyRows, scale * scale}; }
};

/// MNSS's step 6: 3×3, −amount at the corners, 1 + 4 · amount in the middle, border clamp, the result clamped to [0,
/// 1].
struct Sharpen {
    float amount;
    Traits traits() const { return {Memory::own, Stored::image, Pixels::all, kAnyRows, 6}; }
};

/// SRPO's mask: where an offset, rounded half up, is not 0, blurred (Gaussian, σ = 1, radius 3, border zero). Input:
/// raw offsets, 2 channels. Result: 1 channel.
struct OffsetMask {
    // Operations: twice seven products, six sums.
    Traits traits() const { return {Memory::own, Stored::image, Pixels::all, kAnyRows, 26}; }
};

/// SRPO's steps 2 and 4: mask · O + (1 − mask) · interpolated, with O(X, Y) the colour at render pixel (⌊X/s⌋ + ox,
/// ⌊Y/s⌋ + oy), clamped to the image. Inputs: colour, raw offsets (rounded half up here), mask, interpolated image.
struct Project {
    int scale;
    Traits traits() const { return {Memory::own, Stored::image, Pixels::all, kAnyRows, 3}; }
};

/// Morphological antialiasing: see kernels/mlaa.cl. Input: image of 3 channels.
struct Mlaa {
    // Operations: four neighbours compared where no edge is near.
    Traits traits() const { return {Memory::own, Stored::image, Pixels::all, kAnyRows, 8}; }
};
/// Neighbouring pixels that differ by as much in a channel have an edge between them: Reshetov compares four bits.
inline constexpr float kMlaaThreshold = 1 / 16.0f;
/// How far along an edge its end is looked for, in pixels.
inline constexpr int kMlaaReach = 64;
/// Every pixel as a tile of scale × scale pixels. A view, for pointwise programs alone: each is stored once.
struct Tiles {
    int scale;
    Traits traits() const {
        const Placement placement{.scale = scale, .pixels = Pixels::tiles};
        return {Memory::aliases, Stored::as_input, Pixels::all, rows_of_squares, 0, placement};
    }
};
/// zero_upsample(x, s, J). A view: the zeros are never stored.
struct ZeroUpsample {
    int scale;
    Traits traits() const {
        const Placement placement{.scale = scale, .pixels = Pixels::samples};
        return {Memory::aliases, Stored::as_input, Pixels::all, rows_of_squares, 0, placement};
    }
};

/// maxpool_2. Input: an image whose sides are even.
struct MaxPool {
    Traits traits() const { return {Memory::own, Stored::feature, Pixels::all, rows_of_pooling, 3}; }
};

/// Radiance of display-encoded colours (docs/nss.md), of which `white` is display white's, from 1 to infinity. Input:
/// colour.
struct Radiance {
    double white;
    // Operations: the curve 8, the gain 3.
    Traits traits() const { return {Memory::own, Stored::image, Pixels::all, kAnyRows, 11}; }
};
/// The inverse of Radiance. Input: radiance.
struct Display {
    double white;
    // Operations: as Radiance.
    Traits traits() const { return {Memory::own, Stored::image, Pixels::all, kAnyRows, 11}; }
};

/// The plane of farthest depth that NssScatter begins with, half as large as the depth, at least one pixel along each
/// axis. Input: depth.
struct NssFar {
    Traits traits() const { return {Memory::own, Stored::f32, Pixels::all, kAnyRows, 0}; }
};
/// NSS's depth in the previous frame. Inputs: the plane of NssFar, whose memory it takes, depth, motion.
struct NssScatter {
    // Operations: the nearest of four 3, where it lands 14, four weights 6, two comparisons for each.
    Traits traits() const { return {Memory::in_place, Stored::f32, Pixels::all, kAnyRows, 31}; }
};
/// NSS's guide. Inputs: depth, motion, depth in the previous frame. Result: 3 channels at render resolution: the vector
/// from the previous frame in pixels, NaN where invalid, and the disocclusion.
struct NssGuide {
    // Operations: of 87 a pixel: the nearest of sixteen 15, where it was 20, four pixels at 12, their mean 4.
    Traits traits() const { return {Memory::own, Stored::f32, Pixels::all, kAnyRows, 29}; }
};
/// NSS's flicker. Inputs: radiance, guide, last frame's first 4 channels of the result. Result: the derivative state (4
/// channels) and how unsteady pixels look to the network.
struct NssFlicker {
    // Operations: of 188 a pixel: a look-up 38, a colour 12, five distances 60, six ramps 24, 54 more.
    Traits traits() const { return {Memory::own, Stored::image, Pixels::all, kAnyRows, 38}; }
};
inline constexpr int kNssDerivative = 4;
/// What NSS's network sees, padded. Inputs: radiance, guide, flicker, history, last frame's temporal parameters, which
/// have the result's size.
struct NssInput {
    // Operations: two bilinear filters of three channels, one of four.
    Traits traits() const { return {Memory::own, Stored::image, Pixels::all, kAnyRows, 8}; }
};
inline constexpr int kNssInputs = 12, kNssTemporal = 4, kNssKernel = 36, kNssKernelBlock = 4, kNssPaddedTo = 8;
/// NSS's reconstruction, as radiance. Inputs: radiance, guide, kernels (a pixel for each block of kNssKernelBlock
/// squared padded pixels), temporal parameters, history, which has the result's size.
struct NssResolve {
    // Operations: nine samples' weighted mean and mean square, history by twelve pixels, three encodings.
    Traits traits() const { return {Memory::own, Stored::image, Pixels::all, kAnyRows, 90}; }
};

struct SpaceToDepth {
    int scale;
    Traits traits() const { return {Memory::gathers, Stored::image, Pixels::all, kAnyRows, 0, {.block = scale}}; }
};
struct DepthToSpace {
    int scale;
    Traits traits() const { return {Memory::aliases, Stored::as_input, Pixels::all, kAnyRows, 0, {.block = scale}}; }
};
/// Inputs: any number of values of one size, along channels in this order.
struct Concat {
    Traits traits() const { return {Memory::gathers, Stored::feature, Pixels::all, same_rows, 0}; }
};
/// Channels [first, first + count) of the input.
struct Slice {
    int first;
    int count;
    Traits traits() const {
        return {Memory::aliases, Stored::as_input, Pixels::tiles, same_rows, 0, {.channel = first}};
    }
};

enum class Activation { none, relu };

/// How a convolution reads one of the images that its input is made of.
enum class Reading {
    whole,      // as it is
    pooled,     // maxpool_2 of it
    upsampled,  // upsample(it, 2, 0)
    factor,     // has one channel, by which the whole image before it is multiplied
};

/// conv(a→b), "same". `parameters`: index into Graph::parameters, which have the kernel's size, its groups and stride.
/// The result may be smaller than the input: then it is that of its top left part.
struct Convolution {
    int parameters;
    Activation activation;
    /// Where the input is put together from several images along channels (fuse_convolution_inputs): how each is read,
    /// and the input's size. An image smaller than it that is read whole goes on with its last column and row to the
    /// right and below. A zero-upsampled one is the last.
    std::vector<Reading> readings = {};
    int width = 0, height = 0;
    /// Of a convolution in whole numbers: what its input is rounded to, where that is not stored so; and what its
    /// result is stored as, where that is not floating-point (hand_on_bytes).
    std::optional<Quantization> rounds = {}, result = {};
    Traits traits() const {
        const Pixels reads = readings.empty() ? Pixels::all : Pixels::samples;
        const Stored stored = result ? Stored::bytes : Stored::feature;
        return {Memory::own, stored, reads, rows_of_convolution, operations_of_convolution};
    }
};

/// What convolutions in whole numbers round an image to, in a byte each. Input: image. Only where the bytes are copied
/// to another device (graph/partition.h): such convolutions round as they read.
struct Numbers {
    Quantization quantization;
    Traits traits() const { return {Memory::own, Stored::bytes, Pixels::all, same_rows, 3}; }
};

/// One step of a pointwise program. Operands number the node's inputs first, then the steps before this one.
struct Step {
    enum class Function {
        sigmoid,  // 1 / (1 + e^−a)
        mix,      // c·a + (1 − c)·b
        clamp,    // a clamped to [low, high]
        tanh,
        prelu,            // a where it is positive, else coefficient · a; a coefficient for each channel
        sum,              // a + b
        difference,       // |a − b|
        minimum,          // a where it is smaller, else b, also where a is NaN
        maximum,          // a where it is greater, else b, also where a is NaN
        product,          // a·b
        round,            // half up, ⌊a + ½⌋
        linear,           // addend + Σ coefficient · operand
        softmax,          // over each group of consecutive channels
        channel_maximum,  // of each group, as one channel
        channel_sum,      // likewise
    };
    Function function;
    std::vector<int> operands;
    float low = 0;
    float high = 0;
    /// Of linear, one an operand; of prelu, one a channel.
    std::vector<float> coefficients = {};
    float addend = 0;
    int groups = 1;
};

/// A program that is run on every pixel of inputs, channel by channel but for what is said to be across channels; an
/// input of one channel serves every channel. The result is `results` (operand numbers) one after another along
/// channels. It may be larger than an input, whose last column and row then go on to the right and below.
struct Pointwise {
    std::vector<Step> steps;
    std::vector<int> results;
    Traits traits() const {
        return {Memory::own, Stored::feature, Pixels::tiles, same_rows, 3.0 * static_cast<double>(steps.size())};
    }
};

using Operator = std::variant<Input, Plane, Previous, Import, Upsample, UpsampleMotion, ZeroUpsample, Tiles, Resample,
                              Fit, Easu, Rcas, Dilate, Fill, DepthBefore, PreviousDepth, CheckedMotion, Validity,
                              Reproject, Range, Believed, LandedSource, MiddleMotion, Between, WarpSharply, Residual,
                              Trust, Collect, Warp, MaxPool, Pick, Place, AveragePool, Sharpen, OffsetMask, Project,
                              Mlaa, Radiance, Display, NssFar, NssScatter, NssGuide, NssFlicker, NssInput, NssResolve,
                              SpaceToDepth, DepthToSpace, Concat, Slice, Convolution, Numbers, Pointwise>;

inline Traits traits(const Operator& op) {
    return std::visit(
        []<typename Op>(const Op& alternative) -> Traits {
            static_assert(HasTraits<Op>, "an operator says its traits: see Traits");
            return alternative.traits();
        },
        op);
}

/// Whether no kernel makes such a node's value: it shares the memory of others, or of the frame before.
bool is_view(const Operator& op);
/// Whether it has no memory of its own either.
bool aliases_memory(const Operator& op);
/// Whether a kernel writes it into the memory of its first input, which nothing else reads afterwards.
bool is_in_place(const Operator& op);

}  // namespace clarus::graph
