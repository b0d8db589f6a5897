#include "clarus/interpolator.h"

#include <cstddef>
#include <optional>
#include <vector>

#include "api/c/descriptions.h"
#include "api/c/guard.h"
#include "api/c/handles.h"
#include "api/c/stream.h"
#include "clarus/clarus.h"

using namespace clarus::c;

struct clarus_interpolator {
    clarus::Interpolator interpolator;
    std::optional<clarus::FrameEvent> last;
    TakenProfile profile{};
    std::vector<std::byte> history{};  // that was saved
};

extern "C" {

clarus_status clarus_interpolator_create(const clarus_device* device, int render_width, int render_height,
                                         int output_width, int output_height, const clarus_options* options,
                                         clarus_interpolator** interpolator) {
    return guarded([&] {
        clarus_interpolator*& created = given(interpolator, "interpolator");
        created =
            new clarus_interpolator{clarus::Interpolator(given(device, "device").device, {render_width, render_height},
                                                         {output_width, output_height}, options_from(options)),
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

clarus_status clarus_interpolator_prepare_with(clarus_interpolator* interpolator, void (*progress)(double, void*),
                                               void* user) {
    return guarded([&] {
        given(progress, "progress");
        given(interpolator, "interpolator").interpolator.prepare([&](double part) { progress(part, user); });
    });
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

clarus_status clarus_interpolator_save_history(clarus_interpolator* interpolator, const void** history, size_t* size) {
    return guarded(
        [&] { save(given(interpolator, "interpolator").history, interpolator->interpolator, history, size); });
}

clarus_status clarus_interpolator_restore_history(clarus_interpolator* interpolator, const void* history, size_t size) {
    return guarded([&] { restore(given(interpolator, "interpolator").interpolator, history, size); });
}

clarus_status clarus_interpolator_take_profile(clarus_interpolator* interpolator, const clarus_stage_profile** stages,
                                               size_t* count) {
    return guarded(
        [&] { take(given(interpolator, "interpolator").profile, interpolator->interpolator, stages, count); });
}

}  // extern "C"
