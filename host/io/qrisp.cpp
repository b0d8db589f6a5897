#include "io/qrisp.h"

#include <algorithm>
#include <optional>

#include "base/error.h"
#include "io/file.h"
#include "io/json_reader.h"

namespace clarus::io {
namespace {

constexpr uintmax_t largest_camera_file = 1 << 20;  // bytes

/// The parts of `<scene>/<540p|360p|270p>/MipBias…Jittered/<segment>`.
struct Segment {
    std::filesystem::path scene, resolution;  // folders
    std::string rendering, name;              // "MipBiasMinus1Jittered", "0000"
    double scale;                             // to 1080p
};

std::optional<Segment> split(const std::filesystem::path& path) {
    std::filesystem::path folder = std::filesystem::absolute(path).lexically_normal();
    if (!folder.has_filename()) folder = folder.parent_path();  // a slash at the end
    Segment segment;
    segment.name = folder.filename().string();
    segment.rendering = folder.parent_path().filename().string();
    segment.resolution = folder.parent_path().parent_path();
    segment.scene = segment.resolution.parent_path();
    const std::string resolution = segment.resolution.filename().string();
    segment.scale = resolution == "540p" ? 2 : resolution == "360p" ? 3 : resolution == "270p" ? 4 : 0;
    if (segment.scale == 0 || !segment.rendering.starts_with("MipBias") || !segment.rendering.ends_with("Jittered"))
        return std::nullopt;
    return segment;
}

bool is_frame_name(const std::string& stem) {
    return stem.size() == 4 && stem.find_first_not_of("0123456789") == std::string::npos;
}

std::vector<std::string> frame_names(const std::filesystem::path& folder) {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder))
        if (entry.path().extension() == ".png" && is_frame_name(entry.path().stem().string()))
            names.push_back(entry.path().stem().string());
    if (names.empty()) fail(ErrorKind::file, "{} has no frames (0000.png, …)", folder.string());
    std::sort(names.begin(), names.end());
    for (size_t i = 1; i < names.size(); ++i)
        if (std::stoi(names[i]) != std::stoi(names[i - 1]) + 1)
            fail(ErrorKind::file, "{}: frames between {} and {} are missing", folder.string(), names[i - 1], names[i]);
    return names;
}

/// As put into the projection matrix, y up: the image moves by it, so the sample moves against it.
Vec2 read_jitter(const std::filesystem::path& camera_file) {
    const nlohmann::json json = parse_json(read_file(camera_file, largest_camera_file), camera_file);
    const JsonNode offset = JsonNode(json, camera_file)["jitter_offset"];
    return {static_cast<float>(-offset["x"].number(-1, 1)), static_cast<float>(offset["y"].number(-1, 1))};
}

}  // namespace

bool looks_like_qrisp(const std::filesystem::path& segment) { return split(segment).has_value(); }

Sequence read_qrisp(const std::filesystem::path& path) {
    const std::optional<Segment> segment = split(path);
    if (!segment)
        fail(ErrorKind::file, "{} is not the folder of a QRISP segment: <scene>/<540p|360p|270p>/MipBias…Jittered/0000",
             path.string());

    Sequence sequence;
    sequence.folder = path;
    sequence.scale = segment->scale;
    sequence.color_space = ColorSpace::srgb;
    sequence.depth_storage = DepthStorage::packed_rgba8;
    sequence.motion = {
        .unit = MotionUnit::uv, .from_previous = true, .y_up = true, .jittered = true, .sampled_at_jitter = true};

    const auto depth = segment->resolution / ("Depth" + segment->rendering) / segment->name;
    const auto motion = segment->resolution / ("MotionVectors" + segment->rendering) / segment->name;
    const auto camera = segment->resolution / "CameraData" / segment->name;
    const auto reference = segment->scene / "1080p" / "Enhanced" / segment->name;
    const bool has_depth = is_directory(depth), has_motion = is_directory(motion),
               has_reference = is_directory(reference);
    for (const std::string& name : frame_names(path)) {
        FrameFiles frame;
        frame.name = name;
        frame.color = path / (name + ".png");
        if (has_depth) frame.depth = depth / (name + ".png");
        if (has_motion) frame.motion = motion / (name + ".exr");
        if (has_reference) frame.reference = reference / (name + ".png");
        frame.jitter = read_jitter(camera / (name + ".json"));
        sequence.frames.push_back(std::move(frame));
    }
    sequence.frames.front().reset = true;
    sequence.render_size = read_image_header(sequence.frames.front().color).size;
    return sequence;
}

Pixels unpack_depth(const Pixels& packed) {
    Pixels depth{packed.size, 1, {}};
    depth.values.reserve(packed.values.size() / 4);
    for (size_t i = 0; i + 3 < packed.values.size(); i += 4) {
        const float* rgba = &packed.values[i];  // r/255 and so on
        depth.values.push_back(static_cast<float>(rgba[0] + (rgba[1] + (rgba[2] + rgba[3] / 255.0) / 255.0) / 255.0));
    }
    return depth;
}

}  // namespace clarus::io
