#include "io/nss.h"

#include <algorithm>
#include <array>
#include <limits>
#include <nlohmann/json.hpp>
#include <span>
#include <string_view>

#include "base/error.h"
#include "base/json_text.h"
#include "io/enclosure.h"
#include "io/file.h"
#include "io/json_reader.h"

namespace clarus::io {
namespace {

constexpr ColorSpace color_space = ColorSpace::linear;
constexpr MotionConvention motion_convention{.unit = MotionUnit::uv, .from_previous = true, .sampled_at_jitter = true};

// What is read of them.
constexpr auto root_fields =
    std::to_array<std::string_view>({"Frames", "EmulatedFramerate", "ReverseZ", "UpscalingRatiosIndices"});
constexpr auto frame_fields = std::to_array<std::string_view>(
    {"NormalizedPerRatioJitter", "CameraCut", "Exposure", "CameraNearPlane", "CameraFarPlane"});

/// "x2", "x1_5".
std::string ratio_name(double scale) {
    std::string name = fmt::format("x{}", scale);
    std::replace(name.begin(), name.end(), '.', '_');
    return name;
}

std::vector<std::filesystem::path> images(const std::filesystem::path& folder) {
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::directory_iterator(folder))
        if (entry.path().extension() == ".exr") files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    return files;
}

/// "UpscalingRatiosIndices" may be missing where there is one ratio only.
size_t jitter_index(const JsonNode& root, const std::string& ratio) {
    const auto indices = root.find("UpscalingRatiosIndices");
    return indices ? (*indices)[ratio + "_index"].integer(0, 1000) : 0;
}

Vec2 read_jitter(const JsonNode& list, size_t index, Size render_size) {
    const std::vector<JsonNode> ratios = list.items();
    if (index >= ratios.size()) list.refuse(fmt::format("a list of more than {}", index));
    const double x = 1.0 / render_size.width, y = 1.0 / render_size.height;  // a pixel
    return {static_cast<float>(ratios[index]["X"].number(-x, x) / x),
            static_cast<float>(ratios[index]["Y"].number(-y, y) / y)};
}

void read_planes(const JsonNode& node, FrameFiles& frame) {
    frame.near_plane = node["CameraNearPlane"].positive();
    const JsonNode far = node["CameraFarPlane"];
    frame.far_plane = static_cast<float>(far.number(-1, std::numeric_limits<float>::max()));
    if (frame.far_plane == -1)
        frame.far_plane = std::numeric_limits<float>::infinity();
    else if (frame.far_plane <= frame.near_plane)
        far.refuse("farther than CameraNearPlane, or -1 for infinity");
}

}  // namespace

Sequence read_nss(const std::filesystem::path& description, double scale) {
    const nlohmann::json json = read_json(description);
    const JsonNode root(json, description);
    root.refuse_misspelt(root_fields);
    const std::string ratio = ratio_name(scale);
    const std::filesystem::path name = description.stem(), inputs = description.parent_path() / ratio;
    const auto reference = description.parent_path() / "ground_truth" / name;
    const std::vector<std::filesystem::path> colors = images(inputs / "color" / name);
    const std::vector<JsonNode> frames = root["Frames"].items();
    if (frames.empty()) root["Frames"].refuse("a list of at least one frame");
    if (frames.size() != colors.size())
        fail(ErrorKind::file, "{}: Frames has {} entries, but {} holds {} images", description.string(), frames.size(),
             (inputs / "color" / name).string(), colors.size());

    Sequence sequence;
    sequence.folder = description.parent_path();
    sequence.render_size = read_image_header(colors.front()).size;
    sequence.scale = scale;
    if (const auto rate = root.find("EmulatedFramerate")) sequence.frame_rate = rate->positive();
    sequence.color_space = color_space;
    sequence.motion = motion_convention;
    sequence.depth = {.projective = true, .reversed = root["ReverseZ"].boolean()};
    const bool has_reference = is_directory(reference);
    const Enclosure dataset(sequence.folder.empty() ? "." : sequence.folder);
    const size_t index = jitter_index(root, ratio);
    for (size_t i = 0; i < frames.size(); ++i) {
        FrameFiles frame;
        frame.name = colors[i].stem().string();
        frame.color = colors[i];
        frame.depth = inputs / "depth" / name / colors[i].filename();
        frame.motion = inputs / "motion" / name / colors[i].filename();
        if (has_reference) frame.reference = reference / colors[i].filename();
        for (const auto& file : {frame.color, frame.depth, frame.motion, frame.reference})
            if (!file.empty()) dataset.require(file);
        frames[i].refuse_misspelt(frame_fields);
        frame.jitter = read_jitter(frames[i]["NormalizedPerRatioJitter"], index, sequence.render_size);
        if (const auto cut = frames[i].find("CameraCut")) frame.reset = cut->boolean();
        if (const auto exposure = frames[i].find("Exposure")) frame.exposure = exposure->positive();
        read_planes(frames[i], frame);
        sequence.frames.push_back(std::move(frame));
    }
    sequence.frames.front().reset = true;
    return sequence;
}

namespace {

class NssOutput : public OutputLayout {
  public:
    explicit NssOutput(std::filesystem::path description) : description_(std::move(description)) {}

    void prescribe(Sequence& sequence) const override {
        sequence.folder = description_.parent_path();
        sequence.color_space = color_space;
        sequence.depth.projective = true;
        sequence.motion = motion_convention;
    }
    FrameFiles place(const Sequence& sequence, size_t index) const override {
        const std::filesystem::path root = description_.parent_path(), inputs = root / ratio_name(sequence.scale);
        const std::filesystem::path name = description_.stem();
        FrameFiles files;
        files.name = fmt::format("{:04}", index);
        const std::string image = files.name + ".exr";
        files.color = inputs / "color" / name / image;
        files.depth = inputs / "depth" / name / image;
        files.motion = inputs / "motion" / name / image;
        files.reference = root / "ground_truth" / name / image;
        return files;
    }
    std::filesystem::path description() const override { return description_; }
    void describe(const Sequence& sequence) const override {
        nlohmann::ordered_json frames = nlohmann::ordered_json::array();
        for (const FrameFiles& frame : sequence.frames) {
            const double x = frame.jitter.x, y = frame.jitter.y;
            const Size size = sequence.render_size;
            frames.push_back({{"CameraNearPlane", frame.near_plane},
                              {"CameraFarPlane", frame.far_plane},
                              {"CameraCut", frame.reset},
                              {"Exposure", frame.exposure},
                              {"Jitter", {{"X", x}, {"Y", y}}},
                              {"NormalizedPerRatioJitter", {{{"X", x / size.width}, {"Y", y / size.height}}}}});
        }
        const nlohmann::ordered_json json = {{"EmulatedFramerate", sequence.frame_rate},
                                             {"ReverseZ", sequence.depth.reversed},
                                             {"UpscalingRatiosIndices", {{ratio_name(sequence.scale) + "_index", 0}}},
                                             {"Frames", std::move(frames)}};
        const std::string text = json_text(json, 1) + "\n";
        write_file_atomically(description_, std::as_bytes(std::span(text)));
    }

  private:
    std::filesystem::path description_;
};

}  // namespace

std::unique_ptr<OutputLayout> nss_output(const std::filesystem::path& description) {
    if (description.extension() != ".json")
        fail(ErrorKind::invalid_argument, "{} is not the description of an NSS capture: <dataset>/<sequence>.json",
             description.string());
    return std::make_unique<NssOutput>(description);
}

}  // namespace clarus::io
