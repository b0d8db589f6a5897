#include <CL/cl.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstring>
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
#include "clarus/jitter.h"
#include "clarus/log.h"
#include "clarus/quality.h"
#include "clarus/upscaler.h"

struct clarus_device {
    explicit clarus_device(clarus::Device opened) : device(std::move(opened)), profiles(device.profiles()) {}
    clarus::Device device;
    std::vector<clarus::DeviceProfile> profiles;
};
struct clarus_model {
    clarus::Model model;
};
struct clarus_list {
    std::vector<std::string> words;
};
namespace {
/// A profile that was taken, and as C has it.
struct TakenProfile {
    std::vector<clarus::StageProfile> stages{};
    std::vector<std::vector<clarus_span>> spans{};
    std::vector<clarus_stage_profile> rows{};
};
}  // namespace
struct clarus_upscaler {
    clarus::Upscaler upscaler;
    std::optional<clarus::FrameEvent> last;
    std::vector<clarus::PlacedPart> parts{};
    std::vector<std::vector<const char*>> stages{};  // of the parts
    clarus::Upscaler::View view{};
    TakenProfile profile{};
    std::vector<std::byte> history{};  // that was saved
};
struct clarus_interpolator {
    clarus::Interpolator interpolator;
    std::optional<clarus::FrameEvent> last;
    TakenProfile profile{};
    std::vector<std::byte> history{};  // that was saved
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

template <typename Stream>
clarus_status wait_for(Stream* stream, const char* name, double seconds, int* done) {
    return guarded([&] {
        int& is_done = given(done, "done");
        const std::optional<clarus::FrameEvent>& last = given(stream, name).last;
        if (!(seconds >= 0))
            clarus::fail(clarus::ErrorKind::invalid_argument, "seconds: {}; must be 0 or more", seconds);
        is_done = !last || last->wait_for(std::chrono::duration<double>(seconds));
    });
}

clarus::ImageFormat format(clarus_format from) { return {static_cast<clarus::ElementType>(from.type), from.channels}; }
clarus_format format(clarus::ImageFormat from) { return {static_cast<clarus_element_type>(from.type), from.channels}; }

clarus::Image image(const clarus_image& from) {
    return {
        from.host, from.buffer, from.offset, from.row_pitch, {from.width, from.height}, {from.origin_x, from.origin_y}};
}

/// As much of a struct as both sides know, over the usual values. `from` may be smaller or larger than what this
/// library knows. Errors: invalid_argument, where something is set that this library does not know.
template <typename Struct>
Struct known(const Struct* from, Struct usual, const char* name) {
    if (!from) return usual;
    const size_t size = from->struct_size;
    if (size < sizeof from->struct_size)
        clarus::fail(clarus::ErrorKind::invalid_argument, "{}.struct_size is {}; begin with clarus_default_{}()", name,
                     size, name);
    const std::byte* bytes = reinterpret_cast<const std::byte*>(from);
    if (size > sizeof usual &&
        std::any_of(bytes + sizeof usual, bytes + size, [](std::byte byte) { return byte != std::byte{}; }))
        clarus::fail(clarus::ErrorKind::invalid_argument, "{} has set what came after version {} of the library", name,
                     CLARUS_VERSION_STRING);
    std::memcpy(&usual, bytes, std::min(size, sizeof usual));
    return usual;
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
    if (from.reactive_format.channels != 0) options.reactive_format = format(from.reactive_format);
    if (from.transparency_format.channels != 0) options.transparency_format = format(from.transparency_format);
    if (from.opaque_format.channels != 0) options.opaque_format = format(from.opaque_format);
    if (from.ui_format.channels != 0) options.ui_format = format(from.ui_format);
    if (from.motion_width != 0 || from.motion_height != 0)
        options.motion_size = clarus::Size{from.motion_width, from.motion_height};
    if (from.exposure_format.channels != 0) options.exposure_format = format(from.exposure_format);
    options.automatic_exposure = from.automatic_exposure != 0;
    options.antialias_input = static_cast<clarus::Antialiasing>(from.antialias_input != 0);
    options.antialias = static_cast<clarus::Antialiasing>(from.antialias != 0);
    options.sharpen = from.sharpen;
    options.dynamic_resolution = from.dynamic_resolution != 0;
    if (from.placement) options.placement = from.placement;
    options.fallback = from.fallback != 0;
    options.diagnose = from.diagnose != 0;
    options.profile = from.profile != 0;
    options.band_rows = from.band_rows;
    if (from.view_count > 0) given(from.views, "options.views");
    for (size_t i = 0; i < from.view_count; ++i) options.views.emplace_back(&given(from.views[i], "one of the views"));
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

clarus::FrameDescription frame_from(const clarus_frame& given_frame) {
    const clarus_frame from = known(&given_frame, clarus_default_frame(), "frame");
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
    frame.reactive_mask = image(from.reactive_mask);
    frame.transparency_mask = image(from.transparency_mask);
    frame.opaque_color = image(from.opaque_color);
    frame.ui = image(from.ui);
    frame.exposure_image = image(from.exposure_image);
    if (from.camera) {
        clarus::FrameParameters::Camera& camera = frame.camera.emplace();
        std::copy_n(from.camera->view, camera.view.size(), camera.view.begin());
        std::copy_n(from.camera->projection, camera.projection.size(), camera.projection.begin());
        camera.near_plane = from.camera->near_plane;
        camera.far_plane = from.camera->far_plane;
        camera.fov_y = from.camera->fov_y;
    }
    frame.wait_for = {from.wait_for, from.wait_for_count};
    return frame;
}

/// `to` is a struct of a program that may know less of it, or more.
template <typename Struct>
void set_usual(Struct* to, Struct usual, size_t struct_size) {
    if (!to) return;
    usual.struct_size = struct_size;
    std::memset(static_cast<void*>(to), 0, struct_size);
    std::memcpy(static_cast<void*>(to), &usual, std::min(struct_size, sizeof usual));
}

clarus_status list_of(clarus_list** list, const auto& words) {
    return guarded([&] {
        clarus_list*& made = given(list, "the list");
        made = new clarus_list{words()};
    });
}

clarus_status jitter(float* x, float* y, const auto& pattern) {
    return guarded([&] {
        const clarus::Vec2 offset = pattern();
        given(x, "x") = offset.x;
        given(y, "y") = offset.y;
    });
}

void take(TakenProfile& taken, auto& stream, const clarus_stage_profile** stages, size_t* count) {
    taken = {stream.take_profile()};
    for (const clarus::StageProfile& stage : taken.stages) {
        std::vector<clarus_span>& spans = taken.spans.emplace_back();
        for (const clarus::StageProfile::Span& span : stage.spans) spans.push_back({span.frame, span.start, span.end});
        taken.rows.push_back({stage.name.c_str(), stage.kernel.c_str(), stage.device, stage.seconds, stage.operations,
                              stage.bytes, spans.data(), spans.size()});
    }
    given(stages, "stages") = taken.rows.data();
    given(count, "count") = taken.rows.size();
}

void save(std::vector<std::byte>& kept, const auto& stream, const void** history, size_t* size) {
    kept = stream.save_history();
    given(history, "history") = kept.data();
    given(size, "size") = kept.size();
}

void restore(auto& stream, const void* history, size_t size) {
    stream.restore_history({&given(static_cast<const std::byte*>(history), "history"), size});
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

int clarus_version(void) { return CLARUS_VERSION; }
const char* clarus_version_string(void) { return CLARUS_VERSION_STRING; }

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

void clarus_options_init(clarus_options* options, size_t struct_size) {
    const clarus::UpscalerOptions from;
    clarus_options usual{};
    usual.motion_scale_x = from.motion.scale.x;
    usual.motion_scale_y = from.motion.scale.y;
    usual.color_format = format(from.color_format);
    usual.depth_format = format(from.depth_format);
    usual.motion_format = format(from.motion_format);
    usual.output_format = format(from.output_format);
    set_usual(options, usual, struct_size);
}

void clarus_frame_init(clarus_frame* frame, size_t struct_size) {
    clarus_frame usual{};
    usual.exposure = 1;
    set_usual(frame, usual, struct_size);
}

clarus_status clarus_upscaler_create(const clarus_device* device, const clarus_model* model, int render_width,
                                     int render_height, const clarus_options* options, clarus_upscaler** upscaler) {
    return guarded([&] {
        const clarus_options used = known(options, clarus_default_options(), "options");
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
        const clarus_options used = known(options, clarus_default_options(), "options");
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

size_t clarus_list_count(const clarus_list* list) { return list ? list->words.size() : 0; }

const char* clarus_list_item(const clarus_list* list, size_t index) {
    return index < clarus_list_count(list) ? list->words[index].c_str() : nullptr;
}

void clarus_list_release(clarus_list* list) { delete list; }

const char* clarus_cache_directory(void) {
    thread_local std::string folder;
    folder = clarus::cache_directory();
    return folder.c_str();
}

clarus_status clarus_list_devices(clarus_list** selectors) {
    return list_of(selectors, [] {
        std::vector<std::string> words;
        for (const clarus::DeviceProfile& profile : clarus::list_devices()) words.push_back(profile.selector);
        return words;
    });
}

clarus_status clarus_device_read_profile(const clarus_device* device, size_t index, clarus_device_profile* profile) {
    return guarded([&] {
        const std::vector<clarus::DeviceProfile>& profiles = given(device, "device").profiles;
        if (index >= profiles.size())
            clarus::fail(clarus::ErrorKind::invalid_argument, "index {}: there are {} devices", index, profiles.size());
        const clarus::DeviceProfile& from = profiles[index];
        clarus_device_profile read{};
        const size_t size = given(profile, "profile").struct_size;
        if (size < sizeof size)
            clarus::fail(clarus::ErrorKind::invalid_argument, "profile.struct_size is {}; set it to its size", size);
        read.selector = from.selector.c_str();
        read.name = from.name.c_str();
        read.vendor = from.vendor.c_str();
        read.platform = from.platform.c_str();
        read.driver_version = from.driver_version.c_str();
        read.opencl_version = from.opencl_version.c_str();
        read.device_class = static_cast<clarus_device_class>(from.device_class);
        read.simulator = from.simulator;
        read.compute_units = from.compute_units;
        read.clock_mhz = from.clock_mhz;
        read.float_vector_width = from.float_vector_width;
        read.max_work_group_size = from.max_work_group_size;
        read.global_memory = from.global_memory;
        read.max_allocation = from.max_allocation;
        read.local_memory = from.local_memory;
        read.memory_alignment = from.memory_alignment;
        read.local_memory_is_dedicated = from.local_memory_is_dedicated;
        read.unified_memory = from.unified_memory;
        read.images = from.images;
        read.half_storage = from.half_storage;
        read.half_arithmetic = from.half_arithmetic;
        read.int8_dot_product = from.int8_dot_product;
        read.vnni = from.vnni;
        read.fast_fma = from.fast_fma;
        read.subgroups = from.subgroups;
        read.sub_devices = from.sub_devices;
        set_usual(profile, read, size);
    });
}

int clarus_device_is_one_context(const clarus_device* device) { return device && device->device.is_one_context(); }

int clarus_device_programs_compiled(const clarus_device* device) {
    return device ? device->device.programs_compiled() : 0;
}

clarus_status clarus_model_names(clarus_list** names) { return list_of(names, clarus::Model::names); }

const char* clarus_model_name(const clarus_model* model) { return model ? model->model.name().c_str() : nullptr; }

const char* clarus_model_pipeline(const clarus_model* model) {
    return model ? model->model.pipeline().c_str() : nullptr;
}

double clarus_model_scale(const clarus_model* model) { return model ? model->model.scale() : 0; }

clarus_status clarus_model_metadata_keys(const clarus_model* model, clarus_list** keys) {
    return list_of(keys, [&] {
        std::vector<std::string> words;
        for (const auto& [key, value] : given(model, "model").model.metadata()) words.push_back(key);
        return words;
    });
}

const char* clarus_model_metadata(const clarus_model* model, const char* key) {
    if (!model || !key) return nullptr;
    const auto found = model->model.metadata().find(key);
    return found == model->model.metadata().end() ? nullptr : found->second.c_str();
}

clarus_status clarus_halton_jitter(int frame, int count, float* x, float* y) {
    return jitter(x, y, [&] { return clarus::halton_jitter(frame, count); });
}

clarus_status clarus_mnss_jitter(int frame, int scale, float* x, float* y) {
    return jitter(x, y, [&] { return clarus::mnss_jitter(frame, scale); });
}

clarus_status clarus_random_jitter(int frame, int scale, float* x, float* y) {
    return jitter(x, y, [&] { return clarus::random_jitter(frame, scale); });
}

clarus_status clarus_quality_modes(clarus_list** names) {
    return list_of(names, [] { return clarus::quality_modes(); });
}

clarus_status clarus_quality_scale(const char* mode, double* scale) {
    return guarded([&] { given(scale, "scale") = clarus::quality_scale(&given(mode, "mode")); });
}

clarus_status clarus_quality_render_size(int output_width, int output_height, double scale, int* width, int* height) {
    return guarded([&] {
        const clarus::Size size = clarus::quality_render_size({output_width, output_height}, scale);
        given(width, "width") = size.width;
        given(height, "height") = size.height;
    });
}

clarus_status clarus_jitter_count(double scale, int* count) {
    return guarded([&] { given(count, "count") = clarus::jitter_count(scale); });
}

clarus_status clarus_mip_bias(double scale, double* bias) {
    return guarded([&] { given(bias, "bias") = clarus::mip_bias(scale); });
}

int clarus_upscaler_needs_depth(const clarus_upscaler* upscaler) {
    return upscaler && upscaler->upscaler.needs_depth();
}

int clarus_upscaler_needs_motion(const clarus_upscaler* upscaler) {
    return upscaler && upscaler->upscaler.needs_motion();
}

clarus_status clarus_upscaler_prepare_with(clarus_upscaler* upscaler, void (*progress)(double, void*), void* user) {
    return guarded([&] {
        given(progress, "progress");
        given(upscaler, "upscaler").upscaler.prepare([&](double part) { progress(part, user); });
    });
}

clarus_status clarus_upscaler_invalid_motion_vectors(const clarus_upscaler* upscaler, unsigned* count) {
    return guarded([&] {
        const std::optional<clarus::FrameEvent>& last = given(upscaler, "upscaler").last;
        given(count, "count") = last ? last->invalid_motion_vectors() : 0;
    });
}

double clarus_upscaler_largest_jitter_distance(const clarus_upscaler* upscaler) {
    return upscaler ? upscaler->upscaler.largest_jitter_distance() : 0;
}

clarus_status clarus_upscaler_view_names(const clarus_upscaler* upscaler, clarus_list** names) {
    return list_of(names, [&] { return given(upscaler, "upscaler").upscaler.view_names(); });
}

clarus_status clarus_upscaler_view(clarus_upscaler* upscaler, const char* name, clarus_view* view) {
    return guarded([&] {
        clarus::Upscaler::View& kept = given(upscaler, "upscaler").view;
        kept = upscaler->upscaler.view(&given(name, "name"));
        given(view, "view") = {kept.size.width, kept.size.height, kept.channels, kept.maps, kept.pixels.data()};
    });
}

clarus_status clarus_upscaler_take_profile(clarus_upscaler* upscaler, const clarus_stage_profile** stages,
                                           size_t* count) {
    return guarded([&] { take(given(upscaler, "upscaler").profile, upscaler->upscaler, stages, count); });
}

int clarus_upscaler_keeps_history(const clarus_upscaler* upscaler) {
    return upscaler && upscaler->upscaler.keeps_history();
}

clarus_status clarus_upscaler_save_history(clarus_upscaler* upscaler, const void** history, size_t* size) {
    return guarded([&] { save(given(upscaler, "upscaler").history, upscaler->upscaler, history, size); });
}

clarus_status clarus_upscaler_restore_history(clarus_upscaler* upscaler, const void* history, size_t size) {
    return guarded([&] { restore(given(upscaler, "upscaler").upscaler, history, size); });
}

clarus_status clarus_interpolator_save_history(clarus_interpolator* interpolator, const void** history, size_t* size) {
    return guarded(
        [&] { save(given(interpolator, "interpolator").history, interpolator->interpolator, history, size); });
}

clarus_status clarus_interpolator_restore_history(clarus_interpolator* interpolator, const void* history, size_t size) {
    return guarded([&] { restore(given(interpolator, "interpolator").interpolator, history, size); });
}

clarus_status clarus_interpolator_prepare_with(clarus_interpolator* interpolator, void (*progress)(double, void*),
                                               void* user) {
    return guarded([&] {
        given(progress, "progress");
        given(interpolator, "interpolator").interpolator.prepare([&](double part) { progress(part, user); });
    });
}

clarus_status clarus_interpolator_take_profile(clarus_interpolator* interpolator, const clarus_stage_profile** stages,
                                               size_t* count) {
    return guarded(
        [&] { take(given(interpolator, "interpolator").profile, interpolator->interpolator, stages, count); });
}

}  // extern "C"
