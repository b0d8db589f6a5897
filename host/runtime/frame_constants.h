#pragma once

namespace clarus::runtime {

/// The frame's numbers that kernels take by value: struct Frame of kernels/common.clh, member by member.
struct FrameConstants {
    float jitter_x = 0, jitter_y = 0;                // J_t, render pixels
    float motion_jitter_x = 0, motion_jitter_y = 0;  // J_m
    float jitter_change_x = 0, jitter_change_y = 0;  // J_{t−1} − J_t where the motion vectors hold the jitter, else 0
    float motion_scale_x = 1, motion_scale_y = 1;    // MotionEncoding::scale
    float motion_step_x = 1, motion_step_y = 1;      // the motion image's pixels in a render pixel
    float depth_numerator = 0, depth_addend = 0;     // projective depth: see ingest.cl
    float exposure = 1;
    float scale = 1;                                   // of the output, in render pixels
    int sample_x = 0, sample_y = 0;                    // q, the sample position in an HR tile
    int previous_sample_x = 0, previous_sample_y = 0;  // the frame before's
    int reset = 0;
    float exposure_share = 0;  // of the way to a frame's own that automatic exposure goes
};

}  // namespace clarus::runtime
