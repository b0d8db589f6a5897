#include "clarus/quality.h"

#include "api/c/guard.h"
#include "api/c/handles.h"
#include "clarus/clarus.h"
#include "clarus/jitter.h"

using namespace clarus::c;

namespace {

clarus_status jitter(float* x, float* y, const auto& pattern) {
    return guarded([&] {
        const clarus::Vec2 offset = pattern();
        given(x, "x") = offset.x;
        given(y, "y") = offset.y;
    });
}

}  // namespace

extern "C" {

clarus_status clarus_halton_jitter(int frame, int count, float* x, float* y) {
    return jitter(x, y, [&] { return clarus::halton_jitter(frame, count); });
}

clarus_status clarus_mnss_jitter(int frame, int scale, float* x, float* y) {
    return jitter(x, y, [&] { return clarus::mnss_jitter(frame, scale); });
}

clarus_status clarus_random_jitter(int frame, int scale, float* x, float* y) {
    return jitter(x, y, [&] { return clarus::random_jitter(frame, scale); });
}

clarus_status clarus_jitter_count(double scale, int* count) {
    return guarded([&] { given(count, "count") = clarus::jitter_count(scale); });
}

clarus_status clarus_mip_bias(double scale, double* bias) {
    return guarded([&] { given(bias, "bias") = clarus::mip_bias(scale); });
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

}  // extern "C"
