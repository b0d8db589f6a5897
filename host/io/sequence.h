#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/rounding.h"
#include "clarus/stream.h"
#include "clarus/types.h"
#include "io/image.h"

namespace clarus::io {

enum class MotionUnit { pixels, uv };

/// docs/formats.md, "motion".
struct MotionConvention {
    MotionUnit unit = MotionUnit::pixels;
    bool from_previous = false;  // the file holds −m
    bool y_up = false;
    bool jittered = false;
    bool sampled_at_jitter = false;
};

struct FrameFiles : FrameParameters {
    // Absolute or relative to the working directory; empty where the frame has none.
    std::filesystem::path color, depth, motion, reference;
    Size render_size;  // where not the sequence's, which is the largest; else {0, 0}
    std::map<std::string, std::filesystem::path> optional;  // "reactive", "ui", … : docs/formats.md
    std::string name;                                       // what the output is numbered by: "0000"
};

enum class DepthStorage { first_channel, packed_rgba8 };  // the latter: QRISP

struct Sequence {
    std::filesystem::path folder;
    Size render_size;
    double scale = 2;
    double frame_rate = 60;
    std::optional<double> mip_bias;  // that colour's textures were sampled with, where it is known
    ColorSpace color_space = ColorSpace::srgb;
    DepthEncoding depth;
    DepthStorage depth_storage = DepthStorage::first_channel;
    MotionConvention motion;
    ChannelNames color_channels, depth_channels, motion_channels;  // of the frames' images, not of references
    std::optional<Size> shown_size;  // of the display, where it is not render_size times scale
    std::vector<FrameFiles> frames;
    bool is_described = true;  // false: images alone, of whose frames no more is known

    /// Of a frame's inputs.
    Size render_size_of(const FrameFiles& frame) const {
        return frame.render_size == Size{} ? render_size : frame.render_size;
    }
    /// Whether frames are rendered at several sizes.
    bool is_dynamic() const;
    /// Of the references.
    Size output_size() const { return shown_size.value_or(scaled(render_size, scale)); }
    /// Output pixels along a side of a render pixel; where its sides differ, the mean of both (geometric).
    double output_scale() const;
    /// Whether some frame has this further image, "reactive", ….
    bool any_has(const std::string& optional) const;
    /// The library's form of `motion`: scale in render pixels, flags.
    MotionEncoding motion_encoding() const;
    /// Its scale for a frame, in the frame's render pixels.
    Vec2 motion_scale(const FrameFiles& frame) const;
};

enum class Layout { guess, native, qrisp, nss, images };

/// Reads a sequence's description (docs/formats.md); images are left to io/frames.h, but for the size that QRISP, NSS
/// captures and images alone do not write down. What `path` is:
///   native: the folder with `sequence.json`, or the JSON itself;
///   QRISP: the segment's folder, `<scene>/<540p|360p|270p>/MipBias…Jittered/<segment>`;
///   NSS capture: `<dataset>/<sequence>.json`, with `scale` saying which of its ratios (folder `x2`, `x1_5`, …);
///   images: a folder of images, or one, to be upscaled by `scale`.
/// `guess` tells them apart by these names. Errors: file, naming the file and the field.
Sequence read_sequence(const std::filesystem::path& path, Layout layout = Layout::guess, double scale = 2);

/// Writes `folder`/sequence.json, atomically, with paths relative to `folder` (made where it is missing). Errors: file;
/// invalid_argument for what the native layout cannot say: images outside the folder, depth that is packed or encoded
/// differently from frame to frame.
void write_sequence(const Sequence& sequence, const std::filesystem::path& folder);

}  // namespace clarus::io
