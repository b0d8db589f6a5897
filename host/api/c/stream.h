#pragma once

#include <CL/cl.h>

#include <chrono>
#include <cstddef>
#include <optional>
#include <vector>

#include "api/c/guard.h"
#include "clarus/clarus.h"
#include "clarus/stream.h"

// What an upscaler and an interpolator have alike.
namespace clarus::c {

/// A profile that was taken, and as C has it.
struct TakenProfile {
    std::vector<StageProfile> stages;
    std::vector<std::vector<clarus_span>> spans;
    std::vector<clarus_stage_profile> rows;
};

/// Whether the last frame has ended, within that time. A stream without a frame has ended.
template <typename Stream>
clarus_status wait_for(Stream* stream, const char* name, double seconds, int* done) {
    return guarded([&] {
        int& is_done = given(done, "done");
        const std::optional<FrameEvent>& last = given(stream, name).last;
        if (!(seconds >= 0)) fail(ErrorKind::invalid_argument, "seconds: {}; must be 0 or more", seconds);
        is_done = !last || last->wait_for(std::chrono::duration<double>(seconds));
    });
}

/// The profile since the last time; it stays until it is taken again.
void take(TakenProfile& taken, auto& stream, const clarus_stage_profile** stages, size_t* count) {
    taken = {stream.take_profile(), {}, {}};
    for (const StageProfile& stage : taken.stages) {
        std::vector<clarus_span>& spans = taken.spans.emplace_back();
        for (const StageProfile::Span& span : stage.spans) spans.push_back({span.frame, span.start, span.end});
        taken.rows.push_back({stage.name.c_str(), stage.kernel.c_str(), stage.device, stage.seconds, stage.operations,
                              stage.bytes, spans.data(), spans.size()});
    }
    given(stages, "stages") = taken.rows.data();
    given(count, "count") = taken.rows.size();
}

/// The history, which stays until it is saved again.
void save(std::vector<std::byte>& kept, const auto& stream, const void** history, size_t* size) {
    kept = stream.save_history();
    given(history, "history") = kept.data();
    given(size, "size") = kept.size();
}

void restore(auto& stream, const void* history, size_t size) {
    stream.restore_history({&given(static_cast<const std::byte*>(history), "history"), size});
}

/// `done` may be null.
inline void hand_out(const FrameEvent& event, cl_event* done) {
    if (!done) return;
    *done = event.get();
    clRetainEvent(*done);
}

inline clarus_memory memory(const MemoryRequirements& from) {
    return {from.weights, from.arena, from.peak_live_bytes, from.staging};
}

}  // namespace clarus::c
