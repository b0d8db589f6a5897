#include <algorithm>
#include <chrono>
#include <exception>
#include <optional>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "base/error.h"
#include "cl/error.h"
#include "clarus/clarus.h"
#include "clarus/error.h"
#include "clarus/interpolator.h"
#include "clarus/log.h"
#include "clarus/upscaler.h"

struct clarus_device {
    explicit clarus_device(clarus::Device opened) : device(std::move(opened)), profiles(device.profiles()) {}
    clarus::Device device;
    std::vector<clarus::DeviceProfile> profiles;
};
struct clarus_model {
    clarus::Model model;
};
struct clarus_upscaler {
    clarus::Upscaler upscaler;
    std::optional<clarus::FrameEvent> last;
    std::vector<clarus::PlacedPart> parts{};
    std::vector<std::vector<const char*>> stages{};  // of the parts
};
struct clarus_interpolator {
    clarus::Interpolator interpolator;
    std::optional<clarus::FrameEvent> last;
};

namespace {

thread_local std::string last_error;

clarus_status status_of(clarus::ErrorKind kind) {
    switch (kind) {
        case clarus::ErrorKind::invalid_argument:
            return CLARUS_INVALID_ARGUMENT;
        case clarus::ErrorKind::file:
            return CLARUS_FILE;
        case clarus::ErrorKind::no_device:
            return CLARUS_NO_DEVICE;
        case clarus::ErrorKind::build:
            return CLARUS_BUILD;
        case clarus::ErrorKind::out_of_memory:
            return CLARUS_OUT_OF_MEMORY;
        case clarus::ErrorKind::device:
            return CLARUS_DEVICE;
    }
    return CLARUS_INTERNAL;
}

/// What a pointer points to. Errors: invalid_argument, naming the argument, where it is null.
template <typename T>
T& given(T* pointer, const char* name) {
    if (!pointer) clarus::fail(clarus::ErrorKind::invalid_argument, "{} is NULL", name);
    return *pointer;
}

/// No exception crosses into C.
template <typename F>
clarus_status guarded(F&& f) {
    try {
        std::forward<F>(f)();
        return CLARUS_OK;
    } catch (const clarus::Error& error) {
        last_error = error.what();
        return status_of(error.kind());
    } catch (const std::bad_alloc& error) {
        last_error = error.what();
        return CLARUS_OUT_OF_MEMORY;
    } catch (const cl::Error& error) {
        last_error = std::string("OpenCL's ") + error.what() + " says " + clarus::ocl::status_name(error.err());
        return CLARUS_DEVICE;
    } catch (const std::system_error& error) {
        last_error = std::string("the system refuses, threads or memory perhaps: ") + error.what();
        return CLARUS_INTERNAL;
    } catch (const std::exception& error) {
        last_error = error.what();
        return CLARUS_INTERNAL;
    }
}

/// Polls, since OpenCL has no wait that ends. Errors: device where the frame failed.
bool is_done_within(const clarus::FrameEvent& event, double seconds) {
    using Clock = std::chrono::steady_clock;
    const auto begin = Clock::now();
    for (auto pause = std::chrono::microseconds(50);; pause = std::min(2 * pause, std::chrono::microseconds(2000))) {
        cl_int status = CL_COMPLETE;
        const cl_event handle = event.get();
        if (clGetEventInfo(handle, CL_EVENT_COMMAND_EXECUTION_STATUS, sizeof status, &status, nullptr) != CL_SUCCESS ||
            status <= CL_COMPLETE) {
            event.wait();
            return true;
        }
        if (std::chrono::duration<double>(Clock::now() - begin).count() >= seconds) return false;
        std::this_thread::sleep_for(pause);
    }
}

template <typename Stream>
clarus_status wait_for(Stream* stream, const char* name, double seconds, int* done) {
    return guarded([&] {
        int& is_done = given(done, "done");
        const std::optional<clarus::FrameEvent>& last = given(stream, name).last;
        if (!(seconds >= 0))
            clarus::fail(clarus::ErrorKind::invalid_argument, "seconds: {}; must be 0 or more", seconds);
        is_done = !last || is_done_within(*last, seconds);
    });
}

clarus::ImageFormat format(clarus_format from) { return {static_cast<clarus::ElementType>(from.type), from.channels}; }
clarus_format format(clarus::ImageFormat from) { return {static_cast<clarus_element_type>(from.type), from.channels}; }

clarus::Image image(const clarus_image& from) {
    return {
        from.host, from.buffer, from.offset, from.row_pitch, {from.width, from.height}, {from.origin_x, from.origin_y}};
}

clarus::UpscalerOptions options_from(const clarus_options& from) {
    clarus::UpscalerOptions options;
    options.precision = static_cast<clarus::Precision>(from.precision);
    options.tuning = static_cast<clarus::Tuning>(from.tuning);
    options.color_space = from.linear_color ? clarus::ColorSpace::linear : clarus::ColorSpace::srgb;
    options.depth = {from.depth_projective != 0, from.depth_reversed != 0};
    options.motion = {
        {from.motion_scale_x, from.motion_scale_y}, from.motion_jittered != 0, from.motion_sampled_at_jitter != 0};
    options.color_format = format(from.color_format);
    options.depth_format = format(from.depth_format);
    options.motion_format = format(from.motion_format);
    options.output_format = format(from.output_format);
    options.antialias_input = static_cast<clarus::Antialiasing>(from.antialias_input != 0);
    options.antialias = static_cast<clarus::Antialiasing>(from.antialias != 0);
    options.sharpen = from.sharpen;
    options.dynamic_resolution = from.dynamic_resolution != 0;
    if (from.placement) options.placement = from.placement;
    options.fallback = from.fallback != 0;
    if (from.output_width != 0 || from.output_height != 0)
        options.output_size = clarus::Size{from.output_width, from.output_height};
    if (from.pipeline_option_count > 0) given(from.pipeline_options, "options.pipeline_options");
    for (size_t i = 0; i < from.pipeline_option_count; ++i) {
        const clarus_pipeline_option& option = from.pipeline_options[i];
        if (!option.name)
            clarus::fail(clarus::ErrorKind::invalid_argument, "options.pipeline_options[{}] has no name", i);
        options.pipeline_options[option.name] = option.value;
    }
    return options;
}

clarus::FrameDescription frame_from(const clarus_frame& from) {
    clarus::FrameDescription frame;
    frame.render_size = {from.render_width, from.render_height};
    if (from.motion_scale_x != 0 || from.motion_scale_y != 0)
        frame.motion_scale = clarus::Vec2{from.motion_scale_x, from.motion_scale_y};
    frame.color = image(from.color);
    frame.depth = image(from.depth);
    frame.motion = image(from.motion);
    frame.jitter = {from.jitter_x, from.jitter_y};
    frame.exposure = from.exposure;
    frame.near_plane = from.near_plane;
    frame.far_plane = from.far_plane;
    frame.reset = from.reset != 0;
    frame.output = image(from.output);
    if (from.wait_for_count > 0) given(from.wait_for, "frame.wait_for");
    for (size_t i = 0; i < from.wait_for_count; ++i)
        if (!from.wait_for[i]) clarus::fail(clarus::ErrorKind::invalid_argument, "frame.wait_for[{}] is NULL", i);
    frame.wait_for = {from.wait_for, from.wait_for_count};
    return frame;
}

/// `done` may be null.
void hand_out(const clarus::FrameEvent& event, cl_event* done) {
    if (!done) return;
    *done = event.get();
    clRetainEvent(*done);
}

clarus_memory memory(const clarus::MemoryRequirements& from) {
    return {from.weights, from.arena, from.peak_live_bytes, from.staging};
}

}  // namespace

extern "C" {

const char* clarus_last_error(void) { return last_error.c_str(); }

void clarus_set_log_callback(void (*callback)(clarus_log_level, const char*, void*), void* user) {
    if (!callback) return clarus::set_log_callback({});
    clarus::set_log_callback([callback, user](clarus::LogLevel level, std::string_view message) {
        callback(static_cast<clarus_log_level>(level), std::string(message).c_str(), user);
    });
}

clarus_status clarus_device_open(const char* selector, clarus_device** device) {
    return guarded([&] {
        clarus_device*& opened = given(device, "device");
        opened = new clarus_device{clarus::Device::open(selector ? selector : "auto")};
    });
}

clarus_status clarus_device_adopt(cl_context context, cl_device_id id, cl_command_queue queue, clarus_device** device) {
    return guarded([&] {
        clarus_device*& adopted = given(device, "device");
        adopted = new clarus_device{clarus::Device::adopt(context, id, queue)};
    });
}

clarus_status clarus_device_together(const clarus_device* const* devices, size_t count, clarus_device** device) {
    return guarded([&] {
        clarus_device*& all = given(device, "device");
        if (count > 0) given(devices, "devices");
        std::vector<clarus::Device> together;
        for (size_t index = 0; index < count; ++index)
            together.push_back(given(devices[index], "one of the devices").device);
        all = new clarus_device{clarus::Device::together(together)};
    });
}

size_t clarus_device_count(const clarus_device* device) { return device ? device->profiles.size() : 0; }

const char* clarus_device_selector(const clarus_device* device, size_t index) {
    return index < clarus_device_count(device) ? device->profiles[index].selector.c_str() : nullptr;
}

void clarus_device_release(clarus_device* device) { delete device; }

clarus_status clarus_model_find(const char* name_or_path, double scale, clarus_model** model) {
    return guarded([&] {
        clarus_model*& found = given(model, "model");
        found = new clarus_model{clarus::Model::find(&given(name_or_path, "name_or_path"), scale)};
    });
}

void clarus_model_scales(const clarus_model* model, double* smallest, double* largest) {
    const clarus::ScaleRange scales = model ? model->model.scales() : clarus::ScaleRange{0, 0};
    if (smallest) *smallest = scales.smallest;
    if (largest) *largest = scales.largest;
}

size_t clarus_model_option_count(const clarus_model* model) { return model ? model->model.options().size() : 0; }

clarus_option_description clarus_model_option(const clarus_model* model, size_t index) {
    if (index >= clarus_model_option_count(model)) return {};
    const clarus::PipelineOption& option = model->model.options()[index];
    return {option.name.c_str(), option.help.c_str(), option.smallest, option.largest, option.usual, option.whole};
}

void clarus_model_release(clarus_model* model) { delete model; }

clarus_options clarus_default_options(void) {
    const clarus::UpscalerOptions from;
    clarus_options options{};
    options.motion_scale_x = from.motion.scale.x;
    options.motion_scale_y = from.motion.scale.y;
    options.color_format = format(from.color_format);
    options.depth_format = format(from.depth_format);
    options.motion_format = format(from.motion_format);
    options.output_format = format(from.output_format);
    return options;
}

clarus_frame clarus_default_frame(void) {
    clarus_frame frame{};
    frame.exposure = 1;
    return frame;
}

clarus_status clarus_upscaler_create(const clarus_device* device, const clarus_model* model, int render_width,
                                     int render_height, const clarus_options* options, clarus_upscaler** upscaler) {
    return guarded([&] {
        const clarus_options used = options ? *options : clarus_default_options();
        clarus_upscaler*& created = given(upscaler, "upscaler");
        created = new clarus_upscaler{clarus::Upscaler(given(device, "device").device, given(model, "model").model,
                                                       {render_width, render_height}, options_from(used)),
                                      {}};
    });
}

void clarus_upscaler_release(clarus_upscaler* upscaler) { delete upscaler; }

void clarus_upscaler_output_size(const clarus_upscaler* upscaler, int* width, int* height) {
    const clarus::Size size = upscaler ? upscaler->upscaler.output_size() : clarus::Size{};
    if (width) *width = size.width;
    if (height) *height = size.height;
}

clarus_status clarus_upscaler_output_size_of(const clarus_upscaler* upscaler, int render_width, int render_height,
                                             int* width, int* height) {
    return guarded([&] {
        const clarus::Size size = given(upscaler, "upscaler").upscaler.output_size({render_width, render_height});
        if (width) *width = size.width;
        if (height) *height = size.height;
    });
}

clarus_memory clarus_upscaler_memory(const clarus_upscaler* upscaler) {
    return upscaler ? memory(upscaler->upscaler.memory_requirements()) : clarus_memory{};
}

clarus_status clarus_upscaler_prepare(clarus_upscaler* upscaler) {
    return guarded([&] { given(upscaler, "upscaler").upscaler.prepare(); });
}

clarus_status clarus_upscaler_submit(clarus_upscaler* upscaler, const clarus_frame* from, cl_event* done) {
    return guarded([&] {
        clarus_upscaler& used = given(upscaler, "upscaler");
        used.last = used.upscaler.submit(frame_from(given(from, "frame")));
        hand_out(*used.last, done);
    });
}

clarus_status clarus_upscaler_wait(clarus_upscaler* upscaler) {
    return guarded([&] {
        if (given(upscaler, "upscaler").last) upscaler->last->wait();
    });
}

clarus_status clarus_upscaler_wait_for(clarus_upscaler* upscaler, double seconds, int* done) {
    return wait_for(upscaler, "upscaler", seconds, done);
}

size_t clarus_upscaler_part_count(clarus_upscaler* upscaler) {
    if (!upscaler) return 0;
    upscaler->parts = upscaler->upscaler.placement();
    upscaler->stages.clear();
    for (const clarus::PlacedPart& part : upscaler->parts) {
        std::vector<const char*>& names = upscaler->stages.emplace_back();
        for (const std::string& stage : part.stages) names.push_back(stage.c_str());
    }
    return upscaler->parts.size();
}

clarus_placed_part clarus_upscaler_part(const clarus_upscaler* upscaler, size_t index) {
    if (!upscaler || index >= upscaler->parts.size()) return {};
    const clarus::PlacedPart& part = upscaler->parts[index];
    const std::vector<const char*>& stages = upscaler->stages[index];
    return {part.device, stages.data(), stages.size(), part.seconds, part.bytes_in};
}

void clarus_upscaler_reset(clarus_upscaler* upscaler) {
    if (upscaler) upscaler->upscaler.reset();
}

clarus_status clarus_interpolator_create(const clarus_device* device, int render_width, int render_height,
                                         int output_width, int output_height, const clarus_options* options,
                                         clarus_interpolator** interpolator) {
    return guarded([&] {
        const clarus_options used = options ? *options : clarus_default_options();
        clarus_interpolator*& created = given(interpolator, "interpolator");
        created =
            new clarus_interpolator{clarus::Interpolator(given(device, "device").device, {render_width, render_height},
                                                         {output_width, output_height}, options_from(used)),
                                    {}};
    });
}

void clarus_interpolator_release(clarus_interpolator* interpolator) { delete interpolator; }

clarus_memory clarus_interpolator_memory(const clarus_interpolator* interpolator) {
    return interpolator ? memory(interpolator->interpolator.memory_requirements()) : clarus_memory{};
}

clarus_status clarus_interpolator_prepare(clarus_interpolator* interpolator) {
    return guarded([&] { given(interpolator, "interpolator").interpolator.prepare(); });
}

clarus_status clarus_interpolator_submit(clarus_interpolator* interpolator, const clarus_frame* from, cl_event* done) {
    return guarded([&] {
        clarus_interpolator& used = given(interpolator, "interpolator");
        used.last = used.interpolator.submit(frame_from(given(from, "frame")));
        hand_out(*used.last, done);
    });
}

clarus_status clarus_interpolator_wait(clarus_interpolator* interpolator) {
    return guarded([&] {
        if (given(interpolator, "interpolator").last) interpolator->last->wait();
    });
}

clarus_status clarus_interpolator_wait_for(clarus_interpolator* interpolator, double seconds, int* done) {
    return wait_for(interpolator, "interpolator", seconds, done);
}

void clarus_interpolator_reset(clarus_interpolator* interpolator) {
    if (interpolator) interpolator->interpolator.reset();
}

}  // extern "C"
