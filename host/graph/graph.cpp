#include "graph/graph.h"

#include <algorithm>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "base/rounding.h"

namespace clarus::graph {
namespace {

// A pipeline that breaks these is a mistake in Clarus, not in a user's input: models and sizes are checked before.
void expect(bool holds, const char* what) {
    if (!holds) throw std::logic_error(what);
}

}  // namespace

Value Graph::add(Operator op, std::vector<Value> inputs, Shape shape, std::string name) {
    nodes.push_back({std::move(op), std::move(inputs), shape, std::move(name)});
    return static_cast<Value>(nodes.size()) - 1;
}

std::vector<Value> Graph::results() const {
    std::vector<Value> results = exports;
    if (output >= 0) results.push_back(output);
    for (const auto& [name, value] : views) results.push_back(value);
    return results;
}

void Graph::rename_results(const std::function<Value(Value)>& renamed) {
    if (output >= 0) output = renamed(output);
    if (history_trust >= 0) history_trust = renamed(history_trust);
    for (Value& value : exports) value = renamed(value);
    for (auto& [name, value] : views) value = renamed(value);
    for (State& state : states) state = {renamed(state.previous), renamed(state.next)};
}

Value Graph::input(Resource resource, Size size) {
    switch (resource) {
        case Resource::color:
            return add(Input{resource}, {}, {3, size.height, size.width}, "color");
        case Resource::depth:
            return add(Input{resource}, {}, {1, size.height, size.width}, "depth");
        case Resource::motion:
            return add(Input{resource}, {}, {2, size.height, size.width}, "motion");
        case Resource::reactive_mask:
            return add(Input{resource}, {}, {1, size.height, size.width}, "reactive mask");
        case Resource::transparency_mask:
            return add(Input{resource}, {}, {1, size.height, size.width}, "transparency mask");
        case Resource::opaque_color:
            return add(Input{resource}, {}, {3, size.height, size.width}, "opaque color");
        case Resource::ui:
            return add(Input{resource}, {}, {4, size.height, size.width}, "ui");
        case Resource::alpha:
            return add(Input{resource}, {}, {1, size.height, size.width}, "alpha channel");
    }
    throw std::logic_error("unknown resource");
}

Value Graph::plane(FrameScalar scalar, Size size) {
    return add(Plane{scalar}, {}, {1, size.height, size.width}, "plane");
}

Value Graph::previous(Shape shape, std::string name) { return add(Previous{}, {}, shape, std::move(name)); }

void Graph::carry(Value previous, Value next) {
    expect(shape(previous) == shape(next), "a state keeps its shape");
    states.push_back({previous, next});
}

Value Graph::upsample(Value image, int scale, Shift shift, std::string name) {
    const Shape in = shape(image);
    return add(Upsample{scale, shift}, {image}, {in.channels, in.height * scale, in.width * scale}, std::move(name));
}

Value Graph::upsample_motion(Value motion, int scale, std::string name) {
    const Shape in = shape(motion);
    expect(in.channels == 2, "motion has two components");
    return add(UpsampleMotion{scale}, {motion}, {2, in.height * scale, in.width * scale}, std::move(name));
}

Value Graph::resample(Value image, Filter filter, double scale, Size size, Shift shift) {
    return add(Resample{filter, scale, shift}, {image}, {shape(image).channels, size.height, size.width}, "resample");
}

Value Graph::resample_freely(Value image, double scale, Size size, std::string name) {
    return add(Resample{Filter::bicubic, scale, Shift::none, false}, {image},
               {shape(image).channels, size.height, size.width}, std::move(name));
}

Value Graph::fit(Value image, Size size, std::string name) {
    const Shape in = shape(image);
    const auto reaches = [](int from, int to) { return to <= kMostFitRatio * from && from <= kMostFitRatio * to; };
    expect(reaches(in.width, size.width) && reaches(in.height, size.height), "an image fits a size near its own");
    return add(Fit{}, {image}, {in.channels, size.height, size.width}, std::move(name));
}

Value Graph::easu(Value color, double scale, Size size) {
    expect(shape(color).channels == 3, "edges are found in colour");
    return add(Easu{scale}, {color}, {3, size.height, size.width}, "easu");
}

Value Graph::rcas(Value color, float sharpness) {
    expect(shape(color).channels == 3, "colour is sharpened");
    return add(Rcas{sharpness}, {color}, shape(color), "rcas");
}

Value Graph::dilate(Value motion, Value depth, int scale) {
    const Shape in = shape(motion);
    expect(shape(depth) == Shape{1, in.height, in.width}, "depth has the motion's size");
    return add(Dilate{scale}, {motion, depth},
               {2, ceil_divide(in.height * scale, kDilationBlock), ceil_divide(in.width * scale, kDilationBlock)},
               "dilate");
}

Value Graph::depth_before(Value motion, Value depth) {
    const Shape in = shape(depth);
    expect(in.channels == 1 && shape(motion) == Shape{2, in.height, in.width}, "depth has the motion's size");
    return add(DepthBefore{}, {motion, depth}, in, "depth before");
}

Value Graph::previous_depth(Value motion, Value depth) {
    const Shape in = shape(depth);
    expect(in.channels == 1 && shape(motion) == Shape{2, in.height, in.width}, "depth has the motion's size");
    const Value ones = add(Fill{1}, {}, in, "previous depth: fill");
    return add(PreviousDepth{}, {ones, motion, depth}, in, "previous depth");
}

Value Graph::landed_depth(Value motion, Value depth, float share) {
    const Shape in = shape(depth);
    expect(in.channels == 1 && shape(motion) == Shape{2, in.height, in.width}, "depth has the motion's size");
    const Value ones = add(Fill{1}, {}, in, "landed depth: fill");
    return add(PreviousDepth{share}, {ones, motion, depth}, in, "landed depth");
}

Value Graph::checked_motion(Value motion, Value depth, Value previous_depth) {
    const Shape in = shape(motion);
    expect(in.channels == 2 && shape(depth) == Shape{1, in.height, in.width} && shape(previous_depth) == shape(depth),
           "depths have the motion's size");
    return add(CheckedMotion{}, {motion, depth, previous_depth}, in, "checked motion");
}

Value Graph::validity(Value motion) {
    const Shape in = shape(motion);
    expect(in.channels == 2, "motion has two components");
    return add(Validity{}, {motion}, {1, in.height, in.width}, "validity");
}

Value Graph::reproject(Value motion, Value depth, double scale, Size size) {
    const Shape in = shape(motion);
    expect(in.channels == 2 && shape(depth) == Shape{1, in.height, in.width}, "depth has the motion's size");
    expect(scale >= 1, "reprojection does not make smaller");
    return add(Reproject{scale}, {motion, depth}, {2, size.height, size.width}, "reproject");
}

Value Graph::range(Value color, Value history, int scale) {
    const Shape in = shape(color), before = shape(history);
    expect(in.channels == 3 && before.channels >= 3, "colours have a range");
    expect(before.height == in.height * scale && before.width == in.width * scale, "history has the output's size");
    return add(Range{scale}, {color, history}, {7, in.height, in.width}, "range");
}

Value Graph::believed(Value range) {
    const Shape in = shape(range);
    expect(in.channels == 7, "a range says what is outside of it");
    return add(Believed{}, {range}, {1, in.height, in.width}, "believed");
}

Value Graph::hold(Value image, Value color, Value history, int scale) {
    return hold(image, history, range(color, history, scale), [&](Value value) { return tiles(value, scale); });
}

Value Graph::hold(Value image, Value history, Value range, const std::function<Value(Value)>& spread) {
    const Value low = spread(slice(range, 0, 3)), high = spread(slice(range, 3, 3));
    const auto lesser = [&](Value a, Value b) { return pointwise(Step::Function::minimum, a, b, "hold"); };
    const auto greater = [&](Value a, Value b) { return pointwise(Step::Function::maximum, a, b, "hold"); };
    const Value inside = lesser(greater(history, low), high);
    const Value seen = mix(history, inside, spread(believed(range)), "hold");
    return lesser(greater(image, lesser(seen, low)), greater(seen, high));
}

Value Graph::landed_source(Value motion, Value depth, Value landed_depth, float share) {
    const Shape in = shape(depth);
    expect(in.channels == 1 && shape(motion) == Shape{2, in.height, in.width} && shape(landed_depth) == in,
           "depths have the motion's size");
    expect(in.elements() < kNoSource, "pixels can be numbered");
    const Value none = add(Fill{kNoSource}, {}, in, "landed source: fill");
    return add(LandedSource{share}, {none, motion, depth, landed_depth}, in, "landed source");
}

Value Graph::middle_motion(Value motion, Value depth, Value landed_source) {
    const Shape in = shape(depth);
    expect(in.channels == 1 && shape(motion) == Shape{2, in.height, in.width} && shape(landed_source) == in,
           "depth and sources have the motion's size");
    return add(MiddleMotion{}, {motion, depth, landed_source}, {kMiddle, in.height, in.width}, "middle motion");
}

Value Graph::between(Value middle, Value color, Value previous, double scale) {
    expect(shape(middle).channels == kMiddle, "middle motion is what middle_motion made");
    expect(shape(color).channels == 3 && shape(previous) == shape(color), "two images of colour");
    expect(scale >= 1, "motion is not made smaller");
    return add(Between{scale}, {middle, color, previous}, shape(color), "between");
}

Value Graph::warp_sharply(Value history, Value motion, Value color, double scale) {
    const Shape in = shape(history);
    expect(in.channels == 4 && shape(color).channels == 3, "history is colour and a weight");
    expect(shape(motion) == Shape{2, in.height, in.width}, "one motion vector for each pixel of the history");
    return add(WarpSharply{scale}, {history, motion, color}, in, "warp sharply");
}

Value Graph::residual(Value color, Value past) {
    expect(shape(color).channels == 3 && shape(past).channels == 4, "history is colour and a weight");
    return add(Residual{}, {color, past}, shape(color), "residual");
}

Value Graph::trust(Value residual, Value motion, double scale) {
    const Shape in = shape(residual);
    expect(in.channels == 3 && shape(motion) == Shape{2, in.height, in.width}, "a motion vector for each residual");
    return add(Trust{scale}, {residual, motion}, {1, in.height, in.width}, "trust");
}

Value Graph::collect(Value color, Value past, Value trust, Value motion, double scale) {
    const Shape in = shape(color), before = shape(past);
    expect(in.channels == 3 && before.channels == 4, "history is colour and a weight");
    expect(shape(trust) == Shape{1, in.height, in.width}, "trust for each sample");
    expect(shape(motion) == Shape{2, before.height, before.width}, "one motion vector for each pixel of the history");
    return add(Collect{scale}, {color, past, trust, motion}, before, "collect");
}

Value Graph::warp(Value image, Value block_motion, int motion_block, Border border, Value fallback, int fallback_scale,
                  std::string name) {
    const Shape in = shape(image);
    const Shape motion = shape(block_motion);
    expect(motion.channels == 2 && motion.height == ceil_divide(in.height, motion_block) &&
               motion.width == ceil_divide(in.width, motion_block),
           "one motion vector for each block of the image");
    const Shape from = shape(fallback);
    expect(from.height * fallback_scale == in.height && from.width * fallback_scale == in.width &&
               from.channels <= in.channels,
           "the fallback covers the image");
    return add(Warp{border, motion_block, fallback_scale}, {image, block_motion, fallback}, in, std::move(name));
}

Value Graph::pick(Value image, int scale, std::string name) {
    const Shape in = shape(image);
    expect(in.height % scale == 0 && in.width % scale == 0, "samples lie in whole tiles");
    return add(Pick{scale}, {image}, {in.channels, in.height / scale, in.width / scale}, std::move(name));
}

Value Graph::place(Value image, Value samples, int scale, std::string name) {
    const Shape in = shape(image), placed = shape(samples);
    expect(placed == Shape{in.channels, in.height / scale, in.width / scale} && in.height % scale == 0 &&
               in.width % scale == 0,
           "a sample for each tile of the image");
    return add(Place{scale}, {image, samples}, in, std::move(name));
}

Value Graph::average_pool(Value image, int scale, std::string name) {
    const Shape in = shape(image);
    expect(in.height % scale == 0 && in.width % scale == 0, "pooling divides the image");
    return add(AveragePool{scale}, {image}, {in.channels, in.height / scale, in.width / scale}, std::move(name));
}

Value Graph::sharpen(Value image, float amount, std::string name) {
    return add(Sharpen{amount}, {image}, shape(image), std::move(name));
}

Value Graph::offset_mask(Value offsets, std::string name) {
    const Shape in = shape(offsets);
    expect(in.channels == 2, "offsets have two components");
    return add(OffsetMask{}, {offsets}, {1, in.height, in.width}, std::move(name));
}

Value Graph::project(Value color, Value offsets, Value mask, Value interpolated, int scale, std::string name) {
    const Shape result = shape(interpolated);
    expect(shape(color) == Shape{result.channels, result.height / scale, result.width / scale} &&
               shape(offsets) == Shape{2, result.height, result.width} &&
               shape(mask) == Shape{1, result.height, result.width},
           "offsets and mask cover the upsampled image");
    return add(Project{scale}, {color, offsets, mask, interpolated}, result, std::move(name));
}

Value Graph::mlaa(Value image, std::string name) {
    expect(shape(image).channels == 3, "colour is antialiased");
    return add(Mlaa{}, {image}, shape(image), std::move(name));
}

Value Graph::warp(Value image, Value motion, Border border, std::string name) {
    const Shape in = shape(image);
    expect(shape(motion) == Shape{2, in.height, in.width}, "one motion vector for each pixel of the image");
    return add(Warp{border, 1, 1}, {image, motion}, in, std::move(name));
}

Value Graph::tiles(Value image, int scale) {
    const Shape in = shape(image);
    return add(Tiles{scale}, {image}, {in.channels, in.height * scale, in.width * scale}, "tiles");
}

Value Graph::zero_upsample(Value image, int scale) {
    const Shape in = shape(image);
    return add(ZeroUpsample{scale}, {image}, {in.channels, in.height * scale, in.width * scale}, "zero_upsample");
}

Value Graph::max_pool(Value image, std::string name) {
    const Shape in = shape(image);
    expect(in.height % 2 == 0 && in.width % 2 == 0, "pooling halves the image");
    return add(MaxPool{}, {image}, {in.channels, in.height / 2, in.width / 2}, std::move(name));
}

Value Graph::radiance(Value color, double white) {
    expect(shape(color).channels == 3 && white >= 1, "colour has radiance");
    return add(Radiance{white}, {color}, shape(color), "radiance");
}

Value Graph::display(Value radiance, double white) {
    expect(shape(radiance).channels == 3 && white >= 1, "colour is shown");
    return add(Display{white}, {radiance}, shape(radiance), "display");
}

Value Graph::nss_guide(Value depth, Value motion) {
    const Shape in = shape(depth);
    expect(in.channels == 1 && shape(motion) == Shape{2, in.height, in.width}, "depth has the motion's size");
    const Shape half{1, std::max(1, in.height / 2), std::max(1, in.width / 2)};
    const Value far = add(NssFar{}, {depth}, half, "guide: farthest depth");
    const Value before = add(NssScatter{}, {far, depth, motion}, half, "guide: depth in the previous frame");
    return add(NssGuide{}, {depth, motion, before}, {3, in.height, in.width}, "guide");
}

Value Graph::nss_flicker(Value radiance, Value guide, Value derivative) {
    const Shape in = shape(radiance);
    expect(shape(guide) == in && in.channels == 3, "a guide for each pixel");
    expect(shape(derivative) == Shape{kNssDerivative, in.height, in.width}, "derivative is what flicker made");
    return add(NssFlicker{}, {radiance, guide, derivative}, {kNssDerivative + 1, in.height, in.width}, "flicker");
}

Value Graph::nss_input(Value radiance, Value guide, Value flicker, Value history, Value temporal) {
    const Shape in = shape(radiance);
    expect(shape(guide) == in && in.channels == 3 && shape(history).channels == 3, "a guide for each pixel");
    expect(shape(flicker) == Shape{kNssDerivative + 1, in.height, in.width}, "flicker for each pixel");
    const Shape padded{kNssInputs, round_up(in.height, kNssPaddedTo), round_up(in.width, kNssPaddedTo)};
    expect(shape(temporal) == Shape{kNssTemporal, padded.height, padded.width}, "temporal parameters are padded");
    return add(NssInput{}, {radiance, guide, flicker, history, temporal}, padded, "network input");
}

Value Graph::nss_resolve(Value radiance, Value guide, Value kernels, Value temporal, Value history) {
    const Shape padded = shape(temporal);
    expect(shape(guide) == shape(radiance) && shape(history).channels == 3, "a guide for each pixel");
    expect(shape(kernels) == Shape{kNssKernel, padded.height / kNssKernelBlock, padded.width / kNssKernelBlock},
           "a kernel for each block");
    return add(NssResolve{}, {radiance, guide, kernels, temporal, history}, shape(history), "resolve");
}

Value Graph::space_to_depth(Value image, int scale) {
    const Shape in = shape(image);
    expect(in.height % scale == 0 && in.width % scale == 0, "space-to-depth divides the image");
    return add(SpaceToDepth{scale}, {image}, {in.channels * scale * scale, in.height / scale, in.width / scale},
               "space_to_depth");
}

Value Graph::depth_to_space(Value image, int scale) {
    const Shape in = shape(image);
    expect(in.channels % (scale * scale) == 0, "depth-to-space divides the channels");
    return add(DepthToSpace{scale}, {image}, {in.channels / (scale * scale), in.height * scale, in.width * scale},
               "depth_to_space");
}

Value Graph::concat(std::vector<Value> inputs, std::string name) {
    expect(!inputs.empty(), "concat joins something");
    Shape result = shape(inputs.front());
    result.channels = 0;
    for (const Value input : inputs) {
        const Shape in = shape(input);
        expect(in.height == result.height && in.width == result.width, "concat joins images of one size");
        result.channels += in.channels;
    }
    return add(Concat{}, std::move(inputs), result, std::move(name));
}

Value Graph::slice(Value image, int first, int count) {
    const Shape in = shape(image);
    expect(first >= 0 && count > 0 && first + count <= in.channels, "a slice lies inside its image");
    return add(Slice{first, count}, {image}, {count, in.height, in.width}, "slice");
}

Value Graph::convolution(Value image, Parameters weights, Activation activation, std::string name) {
    const Size whole{shape(image).width, shape(image).height};
    return convolution(image, std::move(weights), activation, std::move(name), whole);
}

Value Graph::convolution(Value image, Parameters weights, Activation activation, std::string name, Size part) {
    const Shape in = shape(image);
    expect(weights.in_channels == in.channels, "a convolution's weights fit its input");
    expect(weights.kernel % 2 == 1, "a convolution's kernel has a middle");
    expect(in.channels % weights.groups == 0 && weights.out_channels % weights.groups == 0, "groups are of one size");
    expect(part.width <= in.width && part.height <= in.height, "a part is no larger than the whole");
    const Shape result{weights.out_channels, ceil_divide(part.height, weights.stride),
                       ceil_divide(part.width, weights.stride)};
    parameters.push_back(std::make_shared<Parameters>(std::move(weights)));
    Convolution convolution{static_cast<int>(parameters.size()) - 1, activation};
    if (const auto& quantized = parameters.back()->quantized) convolution.rounds = quantized->input;
    return add(std::move(convolution), {image}, result, std::move(name));
}

Value Graph::sigmoid(Value image, std::string name) {
    return add(Pointwise{{{Step::Function::sigmoid, {0}}}, {1}}, {image}, shape(image), std::move(name));
}

Value Graph::mix(Value where_one, Value where_zero, Value weight, std::string name) {
    const Shape in = shape(where_one);
    expect(shape(where_zero) == in, "mixed images have one shape");
    expect(shape(weight).channels == 1 || shape(weight) == in, "a weight for each pixel or each element");
    return add(Pointwise{{{Step::Function::mix, {0, 1, 2}}}, {3}}, {where_one, where_zero, weight}, in,
               std::move(name));
}

Value Graph::clamp(Value image, float low, float high, std::string name) {
    return add(Pointwise{{{Step::Function::clamp, {0}, low, high}}, {1}}, {image}, shape(image), std::move(name));
}

Value Graph::replicate_to(Value image, Size size) {
    const Shape in = shape(image);
    if (size == Size{in.width, in.height}) return image;
    expect(size.width >= in.width && size.height >= in.height, "an image is made larger");
    return add(Pointwise{{}, {0}}, {image}, {in.channels, size.height, size.width}, "replicate");
}

Value Graph::round(Value image, std::string name) {
    return add(Pointwise{{{Step::Function::round, {0}}}, {1}}, {image}, shape(image), std::move(name));
}

Value Graph::tanh(Value image, std::string name) {
    return add(Pointwise{{{Step::Function::tanh, {0}}}, {1}}, {image}, shape(image), std::move(name));
}

Value Graph::prelu(Value image, std::vector<float> slopes, std::string name) {
    expect(static_cast<int>(slopes.size()) == shape(image).channels, "a slope for each channel");
    return add(Pointwise{{{Step::Function::prelu, {0}, 0, 0, std::move(slopes)}}, {1}}, {image}, shape(image),
               std::move(name));
}

Value Graph::pointwise(Step::Function function, Value a, Value b, std::string name) {
    const Shape &left = shape(a), &right = shape(b);
    expect(left.height == right.height && left.width == right.width, "operands have one size");
    expect(left.channels == right.channels || left.channels == 1 || right.channels == 1, "operands have one shape");
    const Shape result{std::max(left.channels, right.channels), left.height, left.width};
    return add(Pointwise{{{function, {0, 1}}}, {2}}, {a, b}, result, std::move(name));
}

Value Graph::sum(Value a, Value b, std::string name) { return pointwise(Step::Function::sum, a, b, std::move(name)); }

Value Graph::difference(Value a, Value b, std::string name) {
    return pointwise(Step::Function::difference, a, b, std::move(name));
}

Value Graph::product(Value a, Value b, std::string name) {
    return pointwise(Step::Function::product, a, b, std::move(name));
}

Value Graph::linear(std::vector<Value> images, std::vector<float> coefficients, float addend, std::string name) {
    expect(!images.empty() && images.size() == coefficients.size(), "a coefficient for each image");
    const Shape result = shape(images.front());
    for (const Value image : images) expect(shape(image) == result, "images that are added have one shape");
    const int count = static_cast<int>(images.size());
    Step step{Step::Function::linear, std::vector<int>(count), 0, 0, std::move(coefficients), addend};
    std::iota(step.operands.begin(), step.operands.end(), 0);
    return add(Pointwise{{std::move(step)}, {count}}, std::move(images), result, std::move(name));
}

Value Graph::across_channels(Step::Function function, Value image, int groups, int channels, std::string name) {
    const Shape in = shape(image);
    expect(groups > 0 && in.channels % groups == 0, "groups are of one size");
    Step step{function, {0}};
    step.groups = groups;
    return add(Pointwise{{std::move(step)}, {1}}, {image}, {channels, in.height, in.width}, std::move(name));
}

Value Graph::softmax(Value image, int groups, std::string name) {
    return across_channels(Step::Function::softmax, image, groups, shape(image).channels, std::move(name));
}

Value Graph::channel_maximum(Value image, int groups, std::string name) {
    return across_channels(Step::Function::channel_maximum, image, groups, groups, std::move(name));
}

Value Graph::channel_sum(Value image, int groups, std::string name) {
    return across_channels(Step::Function::channel_sum, image, groups, groups, std::move(name));
}

}  // namespace clarus::graph
