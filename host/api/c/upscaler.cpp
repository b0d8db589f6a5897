#include "clarus/upscaler.h"

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "api/c/descriptions.h"
#include "api/c/guard.h"
#include "api/c/handles.h"
#include "api/c/stream.h"
#include "clarus/clarus.h"

using namespace clarus::c;

struct clarus_upscaler {
    clarus::Upscaler upscaler;
    std::optional<clarus::FrameEvent> last;
    std::vector<clarus::PlacedPart> parts{};
    std::vector<std::vector<const char*>> stages{};  // of the parts
    clarus::Upscaler::View view{};
    TakenProfile profile{};
    std::vector<std::byte> history{};  // that was saved
};

extern "C" {

clarus_status clarus_upscaler_create(const clarus_device* device, const clarus_model* model, int render_width,
                                     int render_height, const clarus_options* options, clarus_upscaler** upscaler) {
    return guarded([&] {
        clarus_upscaler*& created = given(upscaler, "upscaler");
        created = new clarus_upscaler{clarus::Upscaler(given(device, "device").device, given(model, "model").model,
                                                       {render_width, render_height}, options_from(options)),
                                      {}};
    });
}

void clarus_upscaler_release(clarus_upscaler* upscaler) { delete upscaler; }

int clarus_upscaler_needs_depth(const clarus_upscaler* upscaler) {
    return upscaler && upscaler->upscaler.needs_depth();
}

int clarus_upscaler_needs_motion(const clarus_upscaler* upscaler) {
    return upscaler && upscaler->upscaler.needs_motion();
}

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

clarus_status clarus_upscaler_prepare_with(clarus_upscaler* upscaler, void (*progress)(double, void*), void* user) {
    return guarded([&] {
        given(progress, "progress");
        given(upscaler, "upscaler").upscaler.prepare([&](double part) { progress(part, user); });
    });
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

void clarus_upscaler_reset(clarus_upscaler* upscaler) {
    if (upscaler) upscaler->upscaler.reset();
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

double clarus_upscaler_seconds_alone(const clarus_upscaler* upscaler, size_t device) {
    if (!upscaler) return 0;
    const std::vector<double> seconds = upscaler->upscaler.seconds_alone();
    return device < seconds.size() ? seconds[device] : 0;
}

clarus_status clarus_upscaler_take_profile(clarus_upscaler* upscaler, const clarus_stage_profile** stages,
                                           size_t* count) {
    return guarded([&] { take(given(upscaler, "upscaler").profile, upscaler->upscaler, stages, count); });
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

clarus_status clarus_upscaler_invalid_motion_vectors(const clarus_upscaler* upscaler, unsigned* count) {
    return guarded([&] {
        const std::optional<clarus::FrameEvent>& last = given(upscaler, "upscaler").last;
        given(count, "count") = last ? last->invalid_motion_vectors() : 0;
    });
}

double clarus_upscaler_largest_jitter_distance(const clarus_upscaler* upscaler) {
    return upscaler ? upscaler->upscaler.largest_jitter_distance() : 0;
}

}  // extern "C"
