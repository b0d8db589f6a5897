#include <array>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/rounding.h"
#include "pipelines/history.h"
#include "pipelines/layer.h"
#include "pipelines/pipeline.h"

// NSRR: Xiao et al. 2020, "Neural supersampling for real-time rendering" (docs/pipelines.md, "NSRR"). Layers and their
// stages are called as their tensors.
namespace clarus::pipelines {
namespace {

using graph::Activation;
using graph::Border;
using graph::Graph;
using graph::Parameters;
using graph::Resource;
using graph::Shift;
using graph::Value;

constexpr int kRaw = 4;  // colour and depth

constexpr int kMostPreviousFrames = 4;

/// n, and how many of them are used.
struct PreviousFrames {
    int in_model, used;
};

PreviousFrames previous_frames(const io::Safetensors& model, const PipelineOptions& options) {
    return {model.require_integer("previous_frames", 0, kMostPreviousFrames),
            static_cast<int>(options.at("previous_frames"))};
}

bool sees_ycbcr(const io::Safetensors& model) {
    const std::string& color = model.require_metadata("network_color");
    if (color != "ycbcr" && color != "rgb")
        fail(ErrorKind::file, R"({}: metadata `network_color` is "{}"; known: ycbcr, rgb)", model.path().string(),
             color);
    return color == "ycbcr";
}

/// A layer between the first channels of its input and of its output: maps of frames that are not used are zero, and
/// add nothing.
Parameters part(const Parameters& whole, int out, int in) {
    Parameters result{out, in};
    result.layer = whole.layer;
    const auto take = [&](const auto& from, auto& to) {
        for (int o = 0; o < out; ++o) {
            const auto first = from.begin() + static_cast<std::ptrdiff_t>(o) * whole.in_channels * 9;
            to.insert(to.end(), first, first + static_cast<std::ptrdiff_t>(in) * 9);
        }
    };
    if (whole.quantized) {
        graph::QuantizedWeights& quantized = result.quantized.emplace(*whole.quantized);
        quantized.weights.clear();
        take(whole.quantized->weights, quantized.weights);
        quantized.scales.resize(out);
        quantized.biases.resize(out);
    } else {
        take(whole.weights, result.weights);
        result.biases.assign(whole.biases.begin(), whole.biases.begin() + out);
    }
    return result;
}

class Builder {
  public:
    Builder(const io::Safetensors& model, int scale, Size render, PreviousFrames frames)
        : model_(model),
          scale_(scale),
          output_{render.width * scale, render.height * scale},
          frames_(frames),
          is_ycbcr_(sees_ycbcr(model)),
          history_(history_options(model)),
          color_(graph_.input(Resource::color, render)),
          depth_(graph_.input(Resource::depth, render)),
          motion_(graph_.input(Resource::motion, render)) {}

    Graph build() && {
        // Steps 1 and 2.
        const Value z = graph_.concat({network_color(), depth_}, "colour conversion");
        const Value current = features("features_current", z);

        // Step 3, the oldest first: each map makes room for the next younger one.
        std::vector<Value> history, warped;
        Value motion = -1;
        if (frames_.used > 0) {
            const Value next = graph_.zero_upsample(features("features_previous", z), scale_);
            motion = hr_motion();
            for (int i = 0; i < frames_.used; ++i)
                history.push_back(graph_.previous(graph_.shape(next), "map " + std::to_string(i + 1)));
            warped.resize(frames_.used);
            for (int i = frames_.used - 1; i >= 0; --i)
                warped[i] = graph_.warp(history[i], motion, Border::zero, "warp " + std::to_string(i + 1));

            // Step 8.
            graph_.carry(history[0], next);
            for (int i = 1; i < frames_.used; ++i) graph_.carry(history[i], warped[i - 1]);
        }

        // Steps 4 and 5.
        const Value samples = graph_.zero_upsample(current, scale_);
        std::vector<Value> maps{samples};
        if (frames_.used > 0) {
            const Value weights = reweight(samples, warped);
            for (int i = 0; i < frames_.used; ++i)
                maps.push_back(graph_.product(warped[i], graph_.slice(weights, i, 1), "weighting"));
            graph_.views["weights"] = weights;
            graph_.views["warped"] = graph_.concat(warped);
        }

        // Steps 6 and 7.
        const Value image = unet(std::move(maps));
        const Value rgb = is_ycbcr_ ? to_rgb(image) : in_range(image);
        graph_.output = history_.held ? held(rgb, motion >= 0 ? motion : hr_motion()) : rgb;

        graph_.views.insert({{"features", graph_.slice(current, kRaw, graph_.shape(current).channels - kRaw)},
                             {"input_color", color_},
                             {"input_depth", depth_},
                             {"input_motion", motion_},
                             {"output", graph_.output}});
        graph_.views_by_channel = {"features", "warped", "weights"};
        return std::move(graph_);
    }

  private:
    Value network_color() {
        if (!is_ycbcr_) return color_;
        const std::vector<Value> rgb = channels(color_);
        const auto linear = [&](std::vector<float> coefficients, float addend) {
            return graph_.linear(rgb, std::move(coefficients), addend, "ycbcr");
        };
        return graph_.concat({linear({0.299f, 0.587f, 0.114f}, 0),
                              linear({-0.299f / 1.772f, -0.587f / 1.772f, 0.886f / 1.772f}, 0.5f),
                              linear({0.701f / 1.402f, -0.587f / 1.402f, -0.114f / 1.402f}, 0.5f)});
    }

    Value hr_motion() {
        if (!history_.checked) return graph_.upsample_motion(motion_, scale_, "motion upsampling");
        const graph::Shape& render = graph_.shape(depth_);
        const Size output{render.width * scale_, render.height * scale_};
        const CheckedHistory checked = checked_history(graph_, motion_, depth_, scale_, output);
        graph_.views["validity"] = graph_.validity(checked.checked);
        return checked.motion;
    }

    /// Within what the frame and the last one's output show.
    Value held(Value image, Value motion) {
        const Value previous = graph_.previous(graph_.shape(image), "previous output");
        const Value warped = graph_.warp(previous, motion, 1, Border::clamp, color_, scale_, "previous output: warp");
        const Value output = graph_.hold(image, color_, warped, scale_);
        graph_.carry(previous, output);
        return output;
    }

    Value in_range(Value image) { return history_.held ? image : graph_.clamp(image, 0, 1, "output"); }

    /// Clamped to [0, 1], or to be held, plane by plane: so all of it is one pass.
    Value to_rgb(Value ycbcr) {
        constexpr float kRed = 1.402f, kBlue = 1.772f;
        constexpr float kGreenOfCb = -0.114f * kBlue / 0.587f, kGreenOfCr = -0.299f * kRed / 0.587f;
        const std::vector<Value> planes = channels(ycbcr);
        const auto linear = [&](float cb, float cr) {
            return in_range(graph_.linear(planes, {1, cb, cr}, -(cb + cr) / 2, "output"));
        };
        return graph_.concat({linear(0, kRed), linear(kGreenOfCb, kGreenOfCr), linear(kBlue, 0)});
    }

    std::vector<Value> channels(Value image) {
        std::vector<Value> result;
        for (int channel = 0; channel < graph_.shape(image).channels; ++channel)
            result.push_back(graph_.slice(image, channel, 1));
        return result;
    }

    /// The layer of that name after `image`, and a ReLU after it.
    Value layer(Value image, const std::string& name) {
        return graph_.convolution(image, read_layer(model_, name, kAny, graph_.shape(image).channels), Activation::relu,
                                  name);
    }

    Value features(const std::string& set, Value z) {
        Value x = z;
        for (const char* index : {".0", ".1", ".2"}) x = layer(x, set + index);
        return graph_.concat({z, x}, set);
    }

    Value reweight(Value samples, const std::vector<Value>& warped) {
        const int used = frames_.used, all = frames_.in_model;
        std::vector<Value> raw{graph_.slice(samples, 0, kRaw)};
        for (const Value map : warped) raw.push_back(graph_.slice(map, 0, kRaw));
        const Parameters first = read_layer(model_, "reweight.0", kAny, kRaw * (1 + all));
        Value x = graph_.concat(raw, "reweight.input");
        x = graph_.convolution(x, part(first, first.out_channels, kRaw * (1 + used)), Activation::relu, "reweight.0");
        x = layer(x, "reweight.1");
        const int channels = graph_.shape(x).channels;
        x = graph_.convolution(x, part(read_layer(model_, "reweight.2", all, channels), used, channels),
                               Activation::none, "reweight.2");
        return graph_.linear({graph_.tanh(x, "reweight.tanh")}, {5}, 5, "reweight.tanh");
    }

    Value unet(std::vector<Value> maps) {
        const auto whole = [](int side) { return round_up(side, 4); };
        const Parameters first = first_layer(maps);
        for (Value& map : maps) map = graph_.replicate_to(map, {whole(output_.width), whole(output_.height)});
        Value x = graph_.concat(maps, "unet.input");
        x = graph_.convolution(x, first, Activation::relu, "unet.enc1.0");
        const Value enc1 = layer(x, "unet.enc1.1");
        x = layer(graph_.max_pool(enc1, "unet.pool1"), "unet.enc2.0");
        const Value enc2 = layer(x, "unet.enc2.1");
        x = layer(graph_.max_pool(enc2, "unet.pool2"), "unet.bottleneck.0");
        x = layer(x, "unet.bottleneck.1");
        x = graph_.concat({graph_.upsample(x, 2, Shift::none, "unet.up2"), enc2});
        x = layer(layer(x, "unet.dec2.0"), "unet.dec2.1");
        x = graph_.concat({graph_.upsample(x, 2, Shift::none, "unet.up1"), enc1});
        x = layer(x, "unet.dec1.0");
        return graph_.convolution(x, read_layer(model_, "unet.dec1.1", 3, graph_.shape(x).channels), Activation::none,
                                  "unet.dec1.1", output_);
    }

    /// Of the U-Net, for the maps that there are.
    Parameters first_layer(const std::vector<Value>& maps) const {
        int in_model = graph_.shape(maps[0]).channels, used = in_model;
        if (frames_.in_model > 0) {
            const io::Tensor& last = model_.require("features_previous.2.bias", std::array<int64_t, 1>{kAny});
            const int map = kRaw + chosen_extent(model_, last.name, last.shape[0]);
            in_model += map * frames_.in_model;
            used += map * frames_.used;
        }
        const Parameters whole = read_layer(model_, "unet.enc1.0", kAny, in_model);
        return part(whole, whole.out_channels, used);
    }

    const io::Safetensors& model_;
    int scale_;
    Size output_;
    PreviousFrames frames_;
    bool is_ycbcr_;
    HistoryOptions history_;
    Graph graph_;
    Value color_, depth_, motion_;
};

}  // namespace

std::vector<PipelineOption> nsrr_options() {
    return {{.name = "previous_frames",
             .help = "how many previous frames are used (the maps of the others are zero)",
             .smallest = 0,
             .largest = kMostPreviousFrames,
             .usual = kMostPreviousFrames,
             .whole = true,
             .limited_by_model = true}};
}

Graph build_nsrr(const io::Safetensors& model, int scale, Size render, const PipelineOptions& options) {
    return Builder(model, scale, render, previous_frames(model, options)).build();
}

}  // namespace clarus::pipelines
