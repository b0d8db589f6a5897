#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "clarus/types.h"
#include "clarus/upscaler.h"
#include "io/image.h"

namespace clarus::io {

enum class MotionUnit { pixels, uv };

/// formats.md, "A sequence": what `motion` says.
struct MotionConvention {
    MotionUnit unit = MotionUnit::pixels;
    bool from_previous = false;  // the file holds −m
    bool y_up = false;
    bool jittered = false;
    bool sampled_at_jitter = false;
};

struct FrameFiles {
    // Absolute or relative to the working directory; empty where the frame has none.
    std::filesystem::path color, depth, motion, reference;
    std::map<std::string, std::filesystem::path> optional;  // "reactive", "ui", … : formats.md
    Vec2 jitter;
    bool reset = false;
    float exposure = 1;
    // Where it differs by frame (NSS capture); else that of the sequence.
    std::optional<DepthEncoding> depth_encoding;
    std::optional<FrameDescription::Camera> camera;
    std::string name;  // what the output is numbered by: "0000"
};

enum class DepthStorage { first_channel, packed_rgba8 };  // the latter: QRISP

struct Sequence {
    std::filesystem::path folder;
    Size render_size;
    double scale = 2;
    double frame_rate = 60;
    ColorSpace color_space = ColorSpace::srgb;
    DepthEncoding depth;
    DepthStorage depth_storage = DepthStorage::first_channel;
    MotionConvention motion;
    std::vector<FrameFiles> frames;

    Size output_size() const {
        return {static_cast<int>(render_size.width * scale + 0.5), static_cast<int>(render_size.height * scale + 0.5)};
    }
    /// The library's form of `motion`: scale in render pixels, flags.
    MotionEncoding motion_encoding() const;
};

}  // namespace clarus::io
