#include "cli/serving.h"

#include <unistd.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "base/error.h"
#include "base/memory.h"
#include "base/parse.h"
#include "cli/host_buffers.h"

namespace clarus::cli {

using nlohmann::json;

/// An upscaler, and what it was made of.
struct Serving::Seat {
    std::shared_ptr<const SharedStream> stream;
    Model model;
    Upscaler upscaler;
    std::optional<HostBuffers> buffers;  // where the device shares the host's memory
};

namespace {

void check_resources(const Upscaler& upscaler, const Model& model, const SharedStream& stream,
                     const std::string& name) {
    const auto check = [&](const char* what, bool needs, bool has) {
        if (needs && !has)
            fail(ErrorKind::invalid_argument, "model {} needs {}, which the stream {} does not have", model.name(),
                 what, name);
    };
    check("depth", upscaler.needs_depth(), stream.has_depth);
    check("motion", upscaler.needs_motion(), stream.has_motion);
}

void check_size(Size shown, const std::optional<Size>& only) {
    if (!only || shown == *only) return;
    fail(ErrorKind::invalid_argument,
         "the output would be of {}x{}, but --output began with {}x{}; output-size={}x{} keeps it", shown.width,
         shown.height, only->width, only->height, only->width, only->height);
}

/// A part of what is asked for; "auto": none.
template <typename Value, typename Parse>
void take(const json& changes, const char* key, const char* example, std::optional<Value>& value, Parse parse) {
    if (!changes.contains(key)) return;
    const std::string text = changes[key].get<std::string>();
    value = parse(text);
    if (!value && text != "auto")
        fail(ErrorKind::invalid_argument, "{}={}: it is as in {}={}, or auto", key, text, key, example);
}

/// Options of pipelines that the model does not have are left out.
std::map<std::string, double> options_of(const Model& model, std::map<std::string, double> options) {
    std::erase_if(options, [&](const auto& option) {
        return std::ranges::none_of(model.options(), [&](const auto& known) { return known.name == option.first; });
    });
    return options;
}

json size_json(Size size) { return {size.width, size.height}; }

}  // namespace

Serving::Serving(std::string name, const SharedSource& source, Settings settings)
    : name_(std::move(name)), source_(source), device_(Device::open(settings.device)), settings_(std::move(settings)) {
    find_model(settings_.wish);
}

std::shared_ptr<Serving::Seat> Serving::prepare(const Settings& settings, std::shared_ptr<const SharedStream> stream,
                                                const Progress& progress) const {
    Model found = find_model(settings.wish);
    io::Sequence sequence = stream->sequence;
    if (sequence.scale == 0) sequence.scale = found.scale();
    auto [model, output_size] =
        choose_model(std::move(found), settings.wish, sequence, stream->is_dynamic, "the stream " + name_);
    UpscalerOptions options = options_for(settings.upscaler, sequence, stream->is_dynamic, output_size);
    options.motion = stream->motion;
    options.color_format = stream->color_format;
    if (stream->has_depth) options.depth_format = stream->depth_format;
    if (stream->has_motion) options.motion_format = stream->motion_format;
    options.reactive_format = stream->reactive_format;
    options.transparency_format = stream->transparency_format;
    options.opaque_format = stream->opaque_format;
    options.ui_format = stream->ui_format;
    Upscaler upscaler(device_, model, sequence.render_size, options);
    check_resources(upscaler, model, *stream, name_);
    check_size(upscaler.output_size(), settings.only_size);
    upscaler.prepare(progress);
    std::optional<HostBuffers> buffers;
    if (device_.profile().unified_memory && device_.is_one_context()) buffers.emplace(device_, stream);
    return {new Seat{std::move(stream), std::move(model), std::move(upscaler), std::move(buffers)}, [](Seat* seat) {
                delete seat;
                return_freed_memory();
            }};
}

void Serving::meet(const Progress& progress) {
    const std::shared_ptr<const SharedStream> stream = source_.stream();
    std::unique_lock lock(mutex_);
    if (current_ && current_->stream->sequence.color_space != stream->sequence.color_space)
        fail(ErrorKind::invalid_argument,
             "the stream {} came back with colour of another space, sRGB or linear; start clarus serve again", name_);
    stream_ = stream;
    const Settings settings = settings_;
    lock.unlock();
    std::shared_ptr<Seat> seat = prepare(settings, stream, progress);
    lock.lock();
    if (settings_.keeps_size) settings_.only_size = seat->upscaler.output_size();
    if (!current_)
        current_ = std::move(seat);
    else if (!next_ || next_->stream != stream)  // what was asked for meanwhile goes before it
        next_.swap(seat);
    lock.unlock();
}

std::shared_ptr<Upscaler> Serving::choose(SourceFrame& frame) {
    std::shared_ptr<Seat> replaced;  // goes after the lock does
    std::unique_lock lock(mutex_);
    std::shared_ptr<Seat> seat = next_ ? std::exchange(next_, {}) : current_;
    if (seat->stream != stream_) {  // of a change that began before the stream came
        const Settings settings = settings_;
        const std::shared_ptr<const SharedStream> stream = stream_;
        lock.unlock();
        seat = prepare(settings, stream, {});
        lock.lock();
    }
    if (seat != current_ && current_->stream == seat->stream) ++changes_;
    replaced = std::exchange(current_, seat);
    lock.unlock();

    if (seat->buffers)
        seat->buffers->replace({&frame.inputs.color, &frame.inputs.depth, &frame.inputs.motion,
                                &frame.inputs.reactive_mask, &frame.inputs.transparency_mask,
                                &frame.inputs.opaque_color, &frame.inputs.ui});
    return {seat, &seat->upscaler};
}

void Serving::change(const json& changes, const Progress& progress) {
    for (const auto& [key, value] : changes.items())
        if (!value.is_string() || (key != "model" && key != "scale" && key != "output-size"))
            fail(ErrorKind::invalid_argument, "there is no {} to change; there are model, scale and output-size", key);
    std::unique_lock lock(mutex_);
    Settings settings = settings_;
    const std::shared_ptr<const SharedStream> stream = stream_;
    lock.unlock();
    settings.wish.model = changes.value("model", settings.wish.model);
    take(changes, "scale", "2", settings.wish.scale, parse_number);
    take(changes, "output-size", "1920x1080", settings.wish.output_size, parse_size);
    if (!stream)
        fail(ErrorKind::invalid_argument, "no renderer shares {} yet, of whose frames the models could be prepared",
             name_);
    std::shared_ptr<Seat> seat;
    try {
        settings.upscaler.pipeline_options =
            options_of(find_model(settings.wish), std::move(settings.upscaler.pipeline_options));
        seat = prepare(settings, stream, progress);
    } catch (const Error& error) {
        if (!settings.wish.scale || changes.contains("scale")) throw;
        fail(error.kind(), "{} (scale={:g} was asked for before; scale=auto takes that back)", error.what(),
             *settings.wish.scale);
    }
    lock.lock();
    settings.only_size = settings_.only_size;
    check_size(seat->upscaler.output_size(), settings.only_size);
    settings_ = std::move(settings);
    next_.swap(seat);
    lock.unlock();  // before what was asked for and never shown goes
}

json Serving::state() const {
    const SharedSource::Figures figures = source_.figures();
    const std::lock_guard lock(mutex_);
    json state{{"stream", name_},
               {"process", getpid()},
               {"connected", figures.connected},
               {"frames", figures.frames},
               {"skipped", figures.skipped},
               {"connections", figures.connections},
               {"frames_per_second", figures.frames_per_second},
               {"milliseconds", figures.milliseconds},
               {"changes", changes_}};
    const std::shared_ptr<Seat>& seat = next_ ? next_ : current_;
    if (!seat) return state;
    state["model"] = seat->model.name();
    state["scale"] = seat->model.scale();
    state["render_size"] = size_json(seat->upscaler.render_size());
    state["output_size"] = size_json(seat->upscaler.output_size());
    state["device"] = device_.profile().name;
    state["copies"] = !seat->buffers;
    return state;
}

const Upscaler& Serving::upscaler() const { return current_->upscaler; }

}  // namespace clarus::cli
