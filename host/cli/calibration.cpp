#include "cli/calibration.h"

#include <algorithm>
#include <optional>
#include <set>
#include <utility>

#include "api/build_graph.h"
#include "api/stream.h"
#include "cli/frame_description.h"
#include "io/frames.h"
#include "metrics/psnr.h"

namespace clarus::cli {
namespace {

constexpr size_t kSampledFrames = 48, kComparedFrames = 12;  // of all, spread evenly
constexpr size_t kSampledPixels = size_t(1) << 17;           // of a layer, in all frames
constexpr size_t kSampledPatches = size_t(1) << 13;          // likewise
constexpr size_t kViewBytes = size_t(1) << 29;               // of a frame's layers at a time

/// Whether frame `index` is one of about `wanted` out of `count`, the last of each stretch: history has begun by then.
bool is_chosen(size_t index, size_t count, size_t wanted) {
    const size_t step = std::max<size_t>(1, count / wanted);
    return index % step == step - 1;
}

std::string view_of(const std::string& layer) { return "read by " + layer; }

/// The value of which all pixels are stored: of a zero-upsampled one, the samples.
graph::Value stored_whole(const graph::Graph& graph, graph::Value value) {
    while (graph::stored_pixels(graph, value) != graph::Pixels::all) value = graph.nodes[value].inputs[0];
    return value;
}

/// The model's graph with a view of what each of those layers reads.
SizedGraph observed(const Model& model, Size render, const std::set<std::string>& layers) {
    const Size output = output_size(render, model.scale());
    SizedGraph result{
        build_graph(model, render, output), {.color = render, .render = render, .output = output}, model.scale()};
    graph::Graph& graph = result.graph;
    for (const graph::Node& node : graph.nodes) {
        const auto* convolution = std::get_if<graph::Convolution>(&node.op);
        if (!convolution) continue;
        const std::string& layer = graph.parameters[convolution->parameters]->layer;
        if (layers.contains(layer)) graph.views[view_of(layer)] = stored_whole(graph, node.inputs[0]);
    }
    return result;
}

/// Layers that are looked at together, so that what is kept for it does not fill the memory.
std::vector<std::set<std::string>> batches(const Model& model, Size render, const std::set<std::string>& layers) {
    const graph::Graph graph = observed(model, render, layers).graph;
    std::vector<std::set<std::string>> result(1);
    size_t bytes = 0;
    for (const std::string& layer : layers) {
        const auto found = graph.views.find(view_of(layer));
        if (found == graph.views.end()) continue;
        const size_t more = graph.shape(found->second).elements() * sizeof(float);
        if (bytes > 0 && bytes + more > kViewBytes) {
            result.emplace_back();
            bytes = 0;
        }
        bytes += more;
        result.back().insert(layer);
    }
    return result;
}

/// Runs a sequence; calls visit(stream, output) after each frame.
template <typename Visit>
void run(const Device& device, const Model& model, const io::Sequence& sequence, const std::set<std::string>& layers,
         Visit&& visit) {
    runtime::PlanOptions options;
    options.color_space = sequence.color_space;
    options.depth = sequence.depth;
    options.motion = sequence.motion_encoding();
    options.dynamic_resolution = sequence.is_dynamic();
    for (const std::string& layer : layers) options.views.push_back(view_of(layer));
    Stream stream(
        device, [&](Size render) { return observed(model, render, layers); }, sequence.render_size, options);
    io::FrameReader reader(sequence, 0, sequence.frames.size(), stream.needs_depth() || stream.needs_motion(), false);
    while (std::optional<io::FrameReader::Frame> frame = reader.next()) {
        const io::FrameFiles& files = sequence.frames[frame->index];
        FrameDescription description = describe_frame(sequence, files, frame->pixels);
        io::Pixels output;
        output.size = stream.sizes(sequence.render_size_of(files)).output;
        output.channels = 3;
        output.values.resize(static_cast<size_t>(output.size.width) * output.size.height * output.channels);
        description.output = image_of(output);
        stream.submit(description).wait();
        visit(stream, std::move(output));
    }
}

}  // namespace

Calibration::Calibration(Device device, std::vector<CalibrationSequence> sequences)
    : device_(std::move(device)), sequences_(std::move(sequences)) {}

void Calibration::check(const Model& model) const {
    for (const CalibrationSequence& each : sequences_) {
        const Upscaler upscaler(device_, model, each.sequence.render_size);
        io::check_sequence(each.sequence, upscaler.needs_depth(), upscaler.needs_motion());
    }
}

size_t Calibration::frames() const {
    size_t count = 0;
    for (const CalibrationSequence& each : sequences_) count += each.sequence.frames.size();
    return count;
}

std::map<std::string, LayerSamples> Calibration::samples(const Model& model, const std::map<std::string, int>& kernels,
                                                         const Progress& progress) const {
    std::set<std::string> layers;
    for (const auto& [name, kernel] : kernels) layers.insert(name);
    std::map<std::string, LayerSamples> result;
    const std::vector<std::set<std::string>> all = batches(model, sequences_.front().sequence.render_size, layers);
    const size_t count = frames(), sampled = std::min(count, kSampledFrames);
    size_t done = 0;
    for (const std::set<std::string>& together : all) {
        size_t index = 0;
        for (const CalibrationSequence& each : sequences_) {
            run(device_, model, each.sequence, together, [&](const Stream& stream, const io::Pixels&) {
                progress(done++, all.size() * count);
                if (!is_chosen(index++, count, sampled)) return;
                for (const std::string& layer : together) {
                    const Upscaler::View view = stream.view(view_of(layer));
                    const auto place = result.try_emplace(layer, view.channels, kernels.at(layer)).first;
                    place->second.add(view.pixels, view.size, kSampledPixels / sampled, kSampledPatches / sampled);
                }
            });
        }
    }
    return result;
}

Calibration::Outputs Calibration::outputs(const Model& model, const Progress& progress) const {
    Outputs result;
    const size_t count = frames();
    size_t index = 0;
    for (const CalibrationSequence& each : sequences_) {
        run(device_, model, each.sequence, {}, [&](const Stream&, io::Pixels&& output) {
            progress(index, count);
            if (is_chosen(index++, count, std::min(count, kComparedFrames))) result.push_back(std::move(output));
        });
    }
    return result;
}

double Calibration::psnr(const Outputs& outputs, const Outputs& reference) {
    double sum = 0;
    for (size_t i = 0; i < outputs.size(); ++i) sum += metrics::mean_squared_error(outputs[i], reference[i]);
    return metrics::psnr(sum / static_cast<double>(outputs.size()));
}

}  // namespace clarus::cli
