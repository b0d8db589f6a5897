#include "io/qrisp.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <ranges>
#include <span>
#include <string_view>
#include <system_error>

#include "base/error.h"
#include "base/json_text.h"
#include "io/enclosure.h"
#include "io/file.h"
#include "io/json_reader.h"

namespace clarus::io {
namespace {

constexpr uintmax_t largest_camera_file = 1 << 20;  // bytes

constexpr const char* not_a_segment =
    "{} is not the folder of a QRISP segment: <scene>/<540p|360p|270p>/MipBias…Jittered/0000";

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

/// "MipBiasMinus1Jittered", "MipBias0Jittered"; none where it is another word.
std::optional<double> mip_bias_of(const Segment& segment) {
    std::string_view number = segment.rendering;
    number.remove_prefix(std::string_view("MipBias").size());
    number.remove_suffix(std::string_view("Jittered").size());
    constexpr std::string_view minus = "Minus";
    const bool is_negative = number.starts_with(minus);
    if (is_negative) number.remove_prefix(minus.size());
    double bias = 0;
    const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), bias);
    if (error != std::errc() || end != number.data() + number.size() || !(bias >= 0 && bias <= 16)) return std::nullopt;
    return is_negative ? -bias : bias;
}

void set_conventions(Sequence& sequence) {
    sequence.color_space = ColorSpace::srgb;
    sequence.depth = {};
    sequence.depth_storage = DepthStorage::packed_rgba8;
    sequence.motion = {
        .unit = MotionUnit::uv, .from_previous = true, .y_up = true, .jittered = true, .sampled_at_jitter = true};
}

FrameFiles files_of(const Segment& segment, const std::filesystem::path& folder, const std::string& name) {
    FrameFiles files;
    files.name = name;
    files.color = folder / (name + ".png");
    files.depth = segment.resolution / ("Depth" + segment.rendering) / segment.name / (name + ".png");
    files.motion = segment.resolution / ("MotionVectors" + segment.rendering) / segment.name / (name + ".exr");
    files.reference = segment.scene / "1080p" / "Enhanced" / segment.name / (name + ".png");
    return files;
}

std::filesystem::path camera_file(const Segment& segment, const std::string& name) {
    return segment.resolution / "CameraData" / segment.name / (name + ".json");
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
    if (!segment) fail(ErrorKind::file, not_a_segment, path.string());

    Sequence sequence;
    sequence.folder = path;
    sequence.scale = segment->scale;
    sequence.mip_bias = mip_bias_of(*segment);
    set_conventions(sequence);
    const Enclosure scene(segment->scene);
    for (const std::string& name : frame_names(path)) {
        FrameFiles frame = files_of(*segment, path, name);
        for (auto file : {&FrameFiles::depth, &FrameFiles::motion, &FrameFiles::reference})
            if (!is_directory((frame.*file).parent_path())) (frame.*file).clear();
        for (const auto& file : {frame.color, frame.depth, frame.motion, frame.reference, camera_file(*segment, name)})
            if (!file.empty()) scene.require(file);
        frame.jitter = read_jitter(camera_file(*segment, name));
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

Pixels pack_depth(const Pixels& depth) {
    constexpr uint64_t one = uint64_t{255} * 255 * 255 * 255;
    Pixels packed{depth.size, 4, {}};
    packed.values.reserve(4 * depth.values.size());
    for (const float value : depth.values) {
        auto units = static_cast<uint64_t>(std::llround(value * static_cast<double>(one)));
        std::array<float, 4> rgba;
        uint64_t weight = one;
        for (float& byte : rgba) {
            weight /= 255;
            const uint64_t digit = std::min<uint64_t>(units / weight, 255);  // 1 is 255 of the first, not 256
            units -= digit * weight;
            byte = static_cast<float>(digit) / 255;
        }
        packed.values.insert(packed.values.end(), rgba.begin(), rgba.end());
    }
    return packed;
}

namespace {

class QrispOutput : public OutputLayout {
  public:
    QrispOutput(std::filesystem::path folder, Segment segment)
        : folder_(std::move(folder)), segment_(std::move(segment)) {}

    void prescribe(Sequence& sequence) const override {
        if (sequence.scale != segment_.scale)
            fail(ErrorKind::invalid_argument, "{} is the folder of a QRISP segment with the scale {}, not {}",
                 folder_.string(), segment_.scale, sequence.scale);
        sequence.folder = folder_;
        set_conventions(sequence);
    }
    FrameFiles place(const Sequence&, size_t index) const override {
        return files_of(segment_, folder_, fmt::format("{:04}", index));
    }
    std::filesystem::path description() const override { return camera_file(segment_, "0000"); }
    void describe(const Sequence& sequence) const override {
        for (const FrameFiles& frame : sequence.frames | std::views::reverse) {
            const nlohmann::json json = {{"jitter_offset", {{"x", -frame.jitter.x}, {"y", frame.jitter.y}}}};
            const std::string text = json_text(json, 1) + "\n";
            write_file_atomically(camera_file(segment_, frame.name), std::as_bytes(std::span(text)));
        }
    }

  private:
    std::filesystem::path folder_;
    Segment segment_;
};

}  // namespace

std::unique_ptr<OutputLayout> qrisp_output(const std::filesystem::path& segment) {
    std::optional<Segment> parts = split(segment);
    if (!parts) fail(ErrorKind::invalid_argument, not_a_segment, segment.string());
    return std::make_unique<QrispOutput>(segment, *std::move(parts));
}

}  // namespace clarus::io
