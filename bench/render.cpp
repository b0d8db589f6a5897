#include <tbb/global_control.h>

#include <ctime>
#include <memory>

#include "bench/suite.h"
#include "clarus/jitter.h"
#include "render/renderer.h"
#include "render/worlds/world.h"

namespace clarus::bench {
namespace {

/// CPU time, so that it does not matter what else runs.
double thread_seconds() {
    timespec time{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

}  // namespace

RenderItem render_item() {
    render::RenderSettings settings;
    settings.render_size = {240, 135};
    settings.output_size = {480, 270};
    const double rays = 480.0 * 270 * settings.reference_grid * settings.reference_grid + 240.0 * 135;
    // Built when it is first asked for a frame: the item may be filtered out.
    const auto world = std::make_shared<render::World>();
    const auto frame = std::make_shared<int>();
    return {{"render", 0, 0,
             [=] {
                 if (!world->scene) *world = render::make_world("demo", 1);
                 const tbb::global_control one_core(tbb::global_control::max_allowed_parallelism, 1);
                 const double start = thread_seconds();
                 const int index = (*frame)++;
                 render::render_frame(*world->scene, world->frame(index), halton_jitter(index, 16), settings);
                 return thread_seconds() - start;
             }},
            rays};
}

}  // namespace clarus::bench
