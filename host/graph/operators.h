#pragma once

#include <variant>
#include <vector>

/// The operators of pipelines.md as plain data. An operator's inputs, in order, and its result are documented here; the
/// definitions are the spec's.
namespace clarus::graph {

enum class Resource { color, depth, motion };

/// A resource of the frame description, converted to its canonical form at render resolution: colour (3 channels,
/// display-encoded), depth (1) or motion (2, render pixels, NaN where invalid).
struct Input {
    Resource resource;
};

enum class FrameScalar { jitter_x, jitter_y, scale };

/// A plane that holds a number of the frame's everywhere.
struct Plane {
    FrameScalar scalar;
};

/// Last frame's value of a state; zero before the first. Which value it becomes: Graph::carry.
struct Previous {};

/// Which jitter shifts the source grid of an upsampling: none, the frame's J, or J_m of the motion vectors.
enum class Shift { none, jitter, motion_jitter };

/// upsample(x, s, J). Input: image.
struct Upsample {
    int scale;
    Shift shift;
};

/// s · upsample(m, s, J_m). Input: motion. Result: 2 channels in HR pixels, NaN where an invalid vector counts: one of
/// the four taps whose weight along each axis exceeds 10⁻³.
struct UpsampleMotion {
    int scale;
};

/// Filters without a network (pipelines/filters/README.md).
enum class Filter { nearest, bilinear, bicubic, lanczos };

/// An image by a filter at any real scale, clamped to [0, 1]. Input: an image of values in [0, 1].
struct Resample {
    Filter filter;
    double scale;
    Shift shift = Shift::jitter;
};

/// EASU, the first pass of FSR 1, at any real scale, aware of the jitter. Input: colour.
struct Easu {
    double scale;
};

/// RCAS, the second pass of FSR 1, its lobe times `sharpness`. Input: colour.
struct Rcas {
    float sharpness;
};

/// dilate(m, d, s). Inputs: motion, depth. Result: 2 channels, one vector (in HR pixels) for each 8×8 block.
struct Dilate {
    int scale;
};
inline constexpr int kDilationBlock = 8;

enum class Border { clamp, zero };

/// warp(I, M, border, fallback). Inputs: image, motion in HR pixels (one vector for each block of `motion_block`
/// squared pixels, NaN where invalid), and the image that gives the fallback: itself where it has the warped image's
/// size, else upsample(fallback, s, J) of a render-resolution one; channels it lacks are 0, as is all of it where there
/// is no such input. On a reset frame all is fallback.
struct Warp {
    Border border;
    int motion_block;
    int fallback_scale;
};

/// A plane that is `value` everywhere, stored as float.
struct Fill {
    float value;
};

// Checked history and held range: docs/history.md.

/// previous_depth(m, d), or landed_depth(m, d) of docs/interpolate.md, which is that at a `share` of the way to the
/// previous frame. Inputs: a plane of ones, in whose place the result is written (Graph::previous_depth), motion,
/// depth. Result: 1 channel at render resolution, stored as float, the same whatever the order in which pixels are
/// seen.
struct PreviousDepth {
    float share = 1;
};

/// checked_motion(m, d, P). Inputs: motion, depth, previous depth. Result: 2 channels at render resolution, NaN where
/// there is no history.
struct CheckedMotion {};

/// validity(m). Input: motion. Result: 1 channel, 0 everywhere in a reset frame.
struct Validity {};

/// reproject(m, d, s) at any real scale from 1, aware of J_m. Inputs: motion, depth. Result: 2 channels in HR pixels,
/// NaN where there is no history.
struct Reproject {
    double scale;
};

/// What `hold` confines colours to. Inputs: colour, HR history, of whose channels the first three count. Result, at
/// render resolution: the least (channels 0–2) and the greatest (3–5) of the 3×3 pixels of colour around each, and 1
/// where the history is outside of them, else 0 (6).
struct Range {
    int scale;
};
/// 1 where the history of most of the pixels around is inside its range, else 0. Input: a Range's result.
struct Believed {};

// The frame between two: docs/interpolate.md.

/// landed_source(m, d, L). Inputs: a plane of kNoSource, in whose place the result is written (Graph::landed_source),
/// motion, depth, landed depth. Result: 1 channel at render resolution, stored as float: numbers of pixels, row by row.
struct LandedSource {
    float share;
};
/// Beyond the number of any pixel; whole numbers up to it are floats.
inline constexpr int kNoSource = 1 << 24;

/// middle_motion(m, d, S). Inputs: motion, depth, landed source. Result: kMiddle channels at render resolution, stored
/// as float: motion, depth, and who shows the pixel, this frame (0), the previous one (1), or nobody knows (½).
struct MiddleMotion {};
inline constexpr int kMiddle = 4;

/// between(M, I, I') at any real scale from 1; I in a reset frame. Inputs: middle motion, this frame's colour at output
/// resolution, the previous frame's.
struct Between {
    double scale;
};

// The project's own network: docs/clarus.md. History is 4 channels HR: colour and the weight of the samples in it.

/// warp_sharply(history, M), and upsample(colour, s, J) of weight 0 where M is invalid and all over a reset frame; any
/// real scale from 1. Inputs: history, motion in HR pixels (a vector for each), colour.
struct WarpSharply {
    double scale;
};

/// sense(past, d, J) at any real scale. Inputs: past, depth. Result: 9 channels at render resolution.
struct Sense {};
inline constexpr int kSensed = 9;

/// compose(colour, past, p, s, J) at any real scale from 1. Inputs: colour, past, p (17 channels at render resolution).
/// Result: the new history.
struct Compose {
    double scale;
};
inline constexpr int kComposeParameters = 17;

// FSR 2's class of upscaler: docs/fsr2.md. History is as above.

/// residual(colour, past, J) at any real scale. Inputs: colour, past. Result: 3 channels at render resolution, in
/// YCoCg.
struct Residual {};
/// trust(D, c, s) at any real scale. Inputs: residual, checked motion. Result: 1 channel at render resolution, from 0
/// to 1.
struct Trust {
    double scale;
};
/// collect(colour, past, t, M, s, J) at any real scale from 1. Inputs: colour, past, trust, motion in HR pixels (a
/// vector for each). Result: the new history.
struct Collect {
    double scale;
};

/// pick(I, s, J). Input: HR image. Result: its pixels at the frame's sample position, at render resolution.
struct Pick {
    int scale;
};
/// place(I, x, s, J). Inputs: HR image, LR samples of as many channels.
struct Place {
    int scale;
};
/// avgpool_s. Input: image.
struct AveragePool {
    int scale;
};

/// MNSS's step 6: 3×3, −amount at the corners, 1 + 4 · amount in the middle, border clamp, the result clamped to [0,
/// 1].
struct Sharpen {
    float amount;
};

/// SRPO's mask: where an offset, rounded half up, is not 0, blurred (Gaussian, σ = 1, radius 3, border zero). Input:
/// raw offsets, 2 channels. Result: 1 channel.
struct OffsetMask {};

/// SRPO's steps 2 and 4: mask · O + (1 − mask) · interpolated, with O(X, Y) the colour at render pixel (⌊X/s⌋ + ox,
/// ⌊Y/s⌋ + oy), clamped to the image. Inputs: colour, raw offsets (rounded half up here), mask, interpolated image.
struct Project {
    int scale;
};

/// Morphological antialiasing: see kernels/mlaa.cl. Input: image of 3 channels.
struct Mlaa {};
/// Neighbouring pixels that differ by as much in a channel have an edge between them: Reshetov compares four bits.
inline constexpr float kMlaaThreshold = 1 / 16.0f;
/// How far along an edge its end is looked for, in pixels.
inline constexpr int kMlaaReach = 64;
/// Every pixel as a tile of scale × scale pixels. A view, for pointwise programs alone: each is stored once.
struct Tiles {
    int scale;
};
/// zero_upsample(x, s, J). A view: the zeros are never stored.
struct ZeroUpsample {
    int scale;
};

/// maxpool_2. Input: an image whose sides are even.
struct MaxPool {};

/// Radiance of display-encoded colours (docs/nss.md), of which `white` is display white's, from 1 to infinity. Input:
/// colour.
struct Radiance {
    double white;
};
/// The inverse of Radiance. Input: radiance.
struct Display {
    double white;
};

/// The plane of farthest depth that NssScatter begins with, half as large as the depth, at least one pixel along each
/// axis. Input: depth.
struct NssFar {};
/// NSS's depth in the previous frame. Inputs: the plane of NssFar, whose memory it takes, depth, motion.
struct NssScatter {};
/// NSS's guide. Inputs: depth, motion, depth in the previous frame. Result: 3 channels at render resolution: the vector
/// from the previous frame in pixels, NaN where invalid, and the disocclusion.
struct NssGuide {};
/// NSS's flicker. Inputs: radiance, guide, last frame's first 4 channels of the result. Result: the derivative state (4
/// channels) and how unsteady pixels look to the network.
struct NssFlicker {};
inline constexpr int kNssDerivative = 4;
/// What NSS's network sees, padded. Inputs: radiance, guide, flicker, history, last frame's temporal parameters, which
/// have the result's size.
struct NssInput {};
inline constexpr int kNssInputs = 12, kNssTemporal = 4, kNssKernel = 36, kNssKernelBlock = 4, kNssPaddedTo = 8;
/// NSS's reconstruction, as radiance. Inputs: radiance, guide, kernels (a pixel for each block of kNssKernelBlock
/// squared padded pixels), temporal parameters, history, which has the result's size.
struct NssResolve {};

struct SpaceToDepth {
    int scale;
};
struct DepthToSpace {
    int scale;
};
/// Inputs: any number of values of one size, along channels in this order.
struct Concat {};
/// Channels [first, first + count) of the input.
struct Slice {
    int first;
    int count;
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
};

using Operator =
    std::variant<Input, Plane, Previous, Upsample, UpsampleMotion, ZeroUpsample, Tiles, Resample, Easu, Rcas, Dilate,
                 Fill, PreviousDepth, CheckedMotion, Validity, Reproject, Range, Believed, LandedSource, MiddleMotion,
                 Between, WarpSharply, Sense, Compose, Residual, Trust, Collect, Warp, MaxPool, Pick, Place,
                 AveragePool, Sharpen, OffsetMask, Project, Mlaa, Radiance, Display, NssFar, NssScatter, NssGuide,
                 NssFlicker, NssInput, NssResolve, SpaceToDepth, DepthToSpace, Concat, Slice, Convolution, Pointwise>;

}  // namespace clarus::graph
