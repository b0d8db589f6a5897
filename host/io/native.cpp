#include "io/native.h"

#include <algorithm>
#include <array>
#include <limits>
#include <set>
#include <span>
#include <string_view>
#include <tuple>

#include "base/error.h"
#include "base/json_text.h"
#include "io/enclosure.h"
#include "io/file.h"
#include "io/json_reader.h"

namespace clarus::io {
namespace {

constexpr int largest_extent = 1 << 15;           // pixels
constexpr double largest_scale = largest_extent;  // that of an image of one pixel
constexpr double largest_bias = 16;               // mip levels
// Images that a frame may have.
constexpr std::array further_images{"reactive",        "transparency",     "opaque_color",     "ui",
                                    "reference_depth", "reference_motion", "reference_aliased"};

// What objects of docs/formats.md may hold.
using Names = std::string_view;
constexpr std::array root_fields =
    std::to_array<Names>({"version", "render_size", "scale", "output_size", "frame_rate", "mip_bias", "color_space",
                          "color", "depth", "motion", "frames"});
constexpr std::array color_fields = std::to_array<Names>({"channels", "part"});
constexpr std::array depth_fields = std::to_array<Names>({"encoding", "reversed", "near", "far", "channels", "part"});
constexpr std::array motion_fields =
    std::to_array<Names>({"unit", "direction", "y", "jittered", "sampled_at", "channels", "part"});
constexpr std::array camera_fields = std::to_array<Names>({"view", "projection", "near", "far", "fov_y"});
constexpr std::array frame_fields = std::to_array<Names>(
    {"color", "depth", "motion", "jitter", "reset", "exposure", "render_size", "reference", "camera", "reactive",
     "transparency", "opaque_color", "ui", "reference_depth", "reference_motion", "reference_aliased"});
static_assert(std::ranges::all_of(further_images, [](Names name) {
    return std::ranges::find(frame_fields, name) != frame_fields.end();
}));

Size read_size(const JsonNode& node) {
    const std::vector<JsonNode> sides = node.items(2);
    return {static_cast<int>(sides[0].integer(1, largest_extent)),
            static_cast<int>(sides[1].integer(1, largest_extent))};
}

/// A path in the JSON: relative to its folder, and after all links still inside.
std::filesystem::path file_inside(const JsonNode& node, const Enclosure& folder) {
    const std::string text = node.text();
    const std::filesystem::path relative = text;
    if (text.empty() || text.find('\0') != std::string::npos || relative.is_absolute())
        node.refuse("a path relative to the sequence's folder");
    const std::filesystem::path path = folder.folder() / relative;
    const char* inside = "a path inside the sequence's folder";
    std::filesystem::path target;
    try {
        target = Enclosure::target_of(path);
    } catch (const std::filesystem::filesystem_error& error) {
        node.refuse(inside, ": " + error.code().message());
    }
    if (folder.holds(target)) return path;
    const bool leaves_by_name = *relative.lexically_normal().begin() == "..";
    node.refuse(inside, leaves_by_name ? ""
                                       : fmt::format(", which a link leads out to {}; put the images themselves there, "
                                                     "or sequence.json into a folder that holds them all",
                                                     target.string()));
}

constexpr float infinity = std::numeric_limits<float>::infinity();

/// {near, far}
std::pair<float, float> read_planes(const JsonNode& node) {
    const float near = node["near"].positive();
    const JsonNode far = node["far"];
    if (far.is_null()) return {near, infinity};
    if (far.positive() <= near) far.refuse("farther than near, or null for infinity");
    return {near, far.positive()};
}

/// `fewest` to `most` of them.
ChannelNames read_channel_names(const JsonNode& node, size_t fewest, size_t most) {
    ChannelNames named;
    if (const auto part = node.find("part"); part && (named.part = part->text()).empty())
        part->refuse("the name of a part");
    const auto channels = node.find("channels");
    if (!channels) return named;
    for (const JsonNode& name : channels->items()) named.names.push_back(name.text());
    const bool repeats = std::set(named.names.begin(), named.names.end()).size() != named.names.size();
    if (named.names.size() < fewest || named.names.size() > most || repeats)
        channels->refuse(most == 1   ? "a list of one channel's name"
                         : most == 2 ? "a list of two different channels' names"
                                     : "a list of three or four different channels' names");
    return named;
}

void read_depth(const JsonNode& node, Sequence& sequence) {
    node.allow_members(depth_fields);
    sequence.depth_channels = read_channel_names(node, 1, 1);
    if (const auto encoding = node.find("encoding"))
        sequence.depth.projective = encoding->choice<bool>({{"linear", false}, {"projective", true}});
    const auto reversed = node.find("reversed");
    if (reversed || sequence.depth.projective) sequence.depth.reversed = node["reversed"].boolean();
    if (!sequence.depth.projective) return;
    const auto [near, far] = read_planes(node);
    for (FrameFiles& frame : sequence.frames) frame.near_plane = near, frame.far_plane = far;
}

MotionConvention read_motion_convention(const JsonNode& node) {
    node.allow_members(motion_fields);
    MotionConvention motion;
    motion.unit = node["unit"].choice<MotionUnit>({{"pixels", MotionUnit::pixels}, {"uv", MotionUnit::uv}});
    motion.from_previous = node["direction"].choice<bool>({{"to_previous", false}, {"from_previous", true}});
    motion.y_up = node["y"].choice<bool>({{"down", false}, {"up", true}});
    motion.jittered = node["jittered"].boolean();
    if (const auto sampled_at = node.find("sampled_at"))
        motion.sampled_at_jitter = sampled_at->choice<bool>({{"centre", false}, {"jittered", true}});
    return motion;
}

std::array<float, 16> read_matrix(const JsonNode& node) {
    constexpr double largest = std::numeric_limits<float>::max();
    std::array<float, 16> matrix;
    auto out = matrix.begin();
    for (const JsonNode& row : node.items(4))
        for (const JsonNode& value : row.items(4)) *out++ = static_cast<float>(value.number(-largest, largest));
    return matrix;
}

FrameDescription::Camera read_camera(const JsonNode& node) {
    node.allow_members(camera_fields);
    FrameDescription::Camera camera;
    camera.view = read_matrix(node["view"]);
    camera.projection = read_matrix(node["projection"]);
    std::tie(camera.near_plane, camera.far_plane) = read_planes(node);
    camera.fov_y = node["fov_y"].positive();
    return camera;
}

/// `largest`: of the sequence.
Size read_frame_size(const JsonNode& node, Size largest) {
    const Size size = read_size(node);
    if (size.width > largest.width || size.height > largest.height)
        node.refuse(fmt::format("at most the sequence's render_size, {}x{}", largest.width, largest.height));
    return size;
}

FrameFiles read_frame_files(const JsonNode& node, const Enclosure& folder, Size largest) {
    node.allow_members(frame_fields);
    FrameFiles frame;
    if (const auto size = node.find("render_size")) frame.render_size = read_frame_size(*size, largest);
    const auto optional_file = [&](const char* key) {
        const auto file = node.find(key);
        return file ? file_inside(*file, folder) : std::filesystem::path();
    };
    frame.color = file_inside(node["color"], folder);
    frame.depth = optional_file("depth");
    frame.motion = optional_file("motion");
    frame.reference = optional_file("reference");
    for (const char* key : further_images)
        if (auto file = optional_file(key); !file.empty()) frame.optional.emplace(key, std::move(file));
    const std::vector<JsonNode> jitter = node["jitter"].items(2);
    frame.jitter = {static_cast<float>(jitter[0].number(-1, 1)), static_cast<float>(jitter[1].number(-1, 1))};
    if (const auto reset = node.find("reset")) frame.reset = reset->boolean();
    if (const auto exposure = node.find("exposure")) frame.exposure = exposure->positive();
    if (const auto camera = node.find("camera")) frame.camera = read_camera(*camera);
    return frame;
}

/// Outputs are numbered like the colour images; where these are not numbered, by their place.
void name_frames(std::vector<FrameFiles>& frames) {
    std::set<std::string> stems;
    for (const FrameFiles& frame : frames) {
        const std::string stem = frame.color.stem().string();
        if (stem.find_first_not_of("0123456789") == std::string::npos) stems.insert(stem);
    }
    for (size_t i = 0; i < frames.size(); ++i)
        frames[i].name = stems.size() == frames.size() ? frames[i].color.stem().string() : fmt::format("{:04}", i);
}

}  // namespace

Sequence read_native(const std::filesystem::path& description) {
    const nlohmann::json json = read_json(description);
    const JsonNode root(json, description);
    root.allow_members(root_fields);
    Sequence sequence;
    sequence.folder = description.has_parent_path() ? description.parent_path() : ".";
    root["version"].integer(1, 1);
    sequence.render_size = read_size(root["render_size"]);
    sequence.scale = root["scale"].number(1, largest_scale);
    if (const auto shown = root.find("output_size")) sequence.shown_size = read_size(*shown);
    if (const auto rate = root.find("frame_rate")) sequence.frame_rate = rate->positive();
    if (const auto bias = root.find("mip_bias")) sequence.mip_bias = bias->number(-largest_bias, largest_bias);
    sequence.color_space =
        root["color_space"].choice<ColorSpace>({{"srgb", ColorSpace::srgb}, {"linear", ColorSpace::linear}});

    const JsonNode frames = root["frames"];
    const Enclosure folder(sequence.folder);
    for (const JsonNode& frame : frames.items())
        sequence.frames.push_back(read_frame_files(frame, folder, sequence.render_size));
    if (sequence.frames.empty()) frames.refuse("a list of at least one frame");
    sequence.frames.front().reset = true;
    name_frames(sequence.frames);

    const auto some_frame_has = [&](std::filesystem::path FrameFiles::*file) {
        return std::ranges::any_of(sequence.frames, [&](const FrameFiles& frame) { return !(frame.*file).empty(); });
    };
    if (some_frame_has(&FrameFiles::depth)) read_depth(root["depth"], sequence);
    if (some_frame_has(&FrameFiles::motion)) {
        sequence.motion = read_motion_convention(root["motion"]);
        sequence.motion_channels = read_channel_names(root["motion"], 2, 2);
    }
    if (const auto color = root.find("color")) {
        color->allow_members(color_fields);
        sequence.color_channels = read_channel_names(*color, 3, 4);
    }
    return sequence;
}

bool looks_native(const std::filesystem::path& file) {
    const auto json = try_parse_json(read_file(file, largest_json));
    return !json || json->contains("frames");
}

namespace {

// Numbers as float: a jitter of −1/6 is then written with the digits that it has.
using Json = nlohmann::basic_json<nlohmann::ordered_map, std::vector, std::string, bool, int64_t, uint64_t, float>;

Json matrix_rows(const std::array<float, 16>& matrix) {
    Json rows = Json::array();
    for (size_t row = 0; row < 16; row += 4)
        rows.push_back({matrix[row], matrix[row + 1], matrix[row + 2], matrix[row + 3]});
    return rows;
}

Json far_or_null(float far) { return far < infinity ? Json(far) : Json(); }

Json describe_frame(const FrameFiles& frame, const std::filesystem::path& folder) {
    Json json = Json::object();
    const auto name = [&](const char* key, const std::filesystem::path& file) {
        if (file.empty()) return;
        const std::filesystem::path relative = std::filesystem::proximate(file, folder);
        if (relative.is_absolute() || *relative.begin() == "..")
            fail(ErrorKind::invalid_argument, "cannot describe a sequence in {}: {} is outside", folder.string(),
                 file.string());
        json[key] = relative.generic_string();
    };
    name("color", frame.color);
    name("depth", frame.depth);
    name("motion", frame.motion);
    if (frame.render_size != Size{}) json["render_size"] = {frame.render_size.width, frame.render_size.height};
    json["jitter"] = {frame.jitter.x, frame.jitter.y};
    if (frame.reset) json["reset"] = true;
    if (frame.exposure != 1) json["exposure"] = frame.exposure;
    name("reference", frame.reference);
    for (const auto& [key, file] : frame.optional) name(key.c_str(), file);
    if (frame.camera)
        json["camera"] = {{"view", matrix_rows(frame.camera->view)},
                          {"projection", matrix_rows(frame.camera->projection)},
                          {"near", frame.camera->near_plane},
                          {"far", far_or_null(frame.camera->far_plane)},
                          {"fov_y", frame.camera->fov_y}};
    return json;
}

}  // namespace

void write_sequence(const Sequence& sequence, const std::filesystem::path& folder) {
    const DepthEncoding& depth = sequence.depth;
    const MotionConvention& motion = sequence.motion;
    const auto has_other_planes = [&](const FrameFiles& frame) {
        return frame.near_plane != sequence.frames.front().near_plane ||
               frame.far_plane != sequence.frames.front().far_plane;
    };
    if (sequence.frames.empty() || sequence.depth_storage != DepthStorage::first_channel ||
        (depth.projective && std::ranges::any_of(sequence.frames, has_other_planes)))
        fail(ErrorKind::invalid_argument,
             "the native layout needs a frame, has no packed depth, and the same near and far for all frames");

    Json json = {{"version", 1},
                 {"render_size", {sequence.render_size.width, sequence.render_size.height}},
                 {"scale", sequence.scale},
                 {"frame_rate", sequence.frame_rate},
                 {"color_space", sequence.color_space == ColorSpace::linear ? "linear" : "srgb"},
                 {"depth", {{"encoding", depth.projective ? "projective" : "linear"}, {"reversed", depth.reversed}}},
                 {"motion",
                  {{"unit", motion.unit == MotionUnit::uv ? "uv" : "pixels"},
                   {"direction", motion.from_previous ? "from_previous" : "to_previous"},
                   {"y", motion.y_up ? "up" : "down"},
                   {"jittered", motion.jittered},
                   {"sampled_at", motion.sampled_at_jitter ? "jittered" : "centre"}}},
                 {"frames", Json::array()}};
    if (sequence.mip_bias) json["mip_bias"] = static_cast<float>(*sequence.mip_bias);
    if (sequence.shown_size) json["output_size"] = {sequence.shown_size->width, sequence.shown_size->height};
    if (depth.projective) {
        json["depth"]["near"] = sequence.frames.front().near_plane;
        json["depth"]["far"] = far_or_null(sequence.frames.front().far_plane);
    }
    const auto name_channels = [&](const char* role, const ChannelNames& named) {
        if (!named.part.empty()) json[role]["part"] = named.part;
        if (!named.names.empty()) json[role]["channels"] = named.names;
    };
    name_channels("color", sequence.color_channels);
    name_channels("depth", sequence.depth_channels);
    name_channels("motion", sequence.motion_channels);
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (error) fail(ErrorKind::file, "cannot make the folder {}: {}", folder.string(), error.message());
    for (const FrameFiles& frame : sequence.frames) json["frames"].push_back(describe_frame(frame, folder));

    const std::string text = json_text(json, 1) + "\n";
    write_file_atomically(folder / "sequence.json", std::as_bytes(std::span(text)));
}

namespace {

class NativeOutput : public OutputLayout {
  public:
    explicit NativeOutput(std::filesystem::path folder) : folder_(std::move(folder)) {}

    void prescribe(Sequence& sequence) const override { sequence.folder = folder_; }
    FrameFiles place(const Sequence& sequence, size_t index) const override {
        FrameFiles files;
        files.name = fmt::format("{:04}", index);
        const std::string data = files.name + ".exr";
        const std::string picture = sequence.color_space == ColorSpace::linear ? data : files.name + ".png";
        files.color = folder_ / "color" / picture;
        files.depth = folder_ / "depth" / data;
        files.motion = folder_ / "motion" / data;
        files.reference = folder_ / "reference" / picture;
        files.optional["reference_aliased"] = folder_ / "reference_aliased" / picture;
        for (const char* key : {"reference_depth", "reference_motion"}) files.optional[key] = folder_ / key / data;
        return files;
    }
    std::filesystem::path description() const override { return folder_ / "sequence.json"; }
    void describe(const Sequence& sequence) const override { write_sequence(sequence, folder_); }

  private:
    std::filesystem::path folder_;
};

}  // namespace

std::unique_ptr<OutputLayout> native_output(const std::filesystem::path& folder) {
    return std::make_unique<NativeOutput>(folder);
}

}  // namespace clarus::io
