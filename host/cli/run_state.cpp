#include "cli/run_state.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cstring>
#include <limits>
#include <set>
#include <span>
#include <string_view>

#include "base/error.h"
#include "base/hash.h"
#include "base/parse.h"
#include "io/file.h"
#include "io/safetensors.h"
#include "io/safetensors_writer.h"

namespace clarus::cli {
namespace {

constexpr const char* kForm = "clarus run 1";
constexpr std::string_view kSetting = "setting ";  // before a setting's name, in the metadata
constexpr const char* kWayOut = "leave --resume out to start over";

using Metadata = std::map<std::string, std::string>;

std::string_view text_of(std::span<const std::byte> bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

std::string digest_of(const Metadata& metadata, std::span<const std::byte> upscaler,
                      std::span<const std::byte> interpolator) {
    std::string text;
    for (const auto& [key, value] : metadata)
        if (key != "hash") text += fmt::format("{}:{}={}:{};", key.size(), key, value.size(), value);
    return hexadecimal(hash_of_parts({text, text_of(upscaler), text_of(interpolator)}));
}

size_t index_of(const io::Safetensors& file, const std::string& key) {
    return static_cast<size_t>(file.require_integer(key, 0, std::numeric_limits<int>::max()));
}

std::string channels_of(const io::ChannelNames& names) {
    return fmt::format("{} {}", names.part, fmt::join(names.names, ","));
}

RunState state_of(const io::Safetensors& file) {
    if (file.require_metadata("form") != kForm)
        fail(ErrorKind::file, "{} has the form \"{}\", and \"{}\" is known here", file.path().string(),
             file.require_metadata("form"), kForm);
    const auto bytes_of = [&](const char* name) {
        constexpr int64_t any = -1;
        const std::span<const std::byte> bytes = file.require(name, {&any, 1}).bytes;
        return std::vector<std::byte>(bytes.begin(), bytes.end());
    };
    RunState state;
    state.upscaler = bytes_of("upscaler");
    state.interpolator = bytes_of("interpolator");
    if (file.require_metadata("hash") != digest_of(file.metadata(), state.upscaler, state.interpolator))
        fail(ErrorKind::file, "{} is damaged: its hash is not that of what it holds", file.path().string());
    state.first = index_of(file, "first");
    state.next = index_of(file, "next");
    if (state.first > state.next)
        fail(ErrorKind::file, "{}: its first frame, {}, is after its next, {}", file.path().string(), state.first,
             state.next);
    state.frames = file.require_metadata("frames");
    for (const auto& [key, value] : file.metadata())
        if (key.starts_with(kSetting)) state.settings[key.substr(kSetting.size())] = value;
    return state;
}

}  // namespace

std::filesystem::path run_state_file(const std::filesystem::path& output_folder) {
    return output_folder / ".clarus-run.safetensors";
}

std::string digest_of(const io::Sequence& sequence, size_t first, size_t next) {
    std::string text =
        fmt::format("{}x{} {} {} {}{}{} {}{}{}{}{} {};{};{}\n", sequence.render_size.width, sequence.render_size.height,
                    sequence.scale, static_cast<int>(sequence.color_space), sequence.depth.projective,
                    sequence.depth.reversed, static_cast<int>(sequence.depth_storage),
                    static_cast<int>(sequence.motion.unit), sequence.motion.from_previous, sequence.motion.y_up,
                    sequence.motion.jittered, sequence.motion.sampled_at_jitter, channels_of(sequence.color_channels),
                    channels_of(sequence.depth_channels), channels_of(sequence.motion_channels));
    for (size_t i = first; i < next; ++i) {
        const io::FrameFiles& frame = sequence.frames[i];
        const Size size = sequence.render_size_of(frame);
        text += fmt::format("{} {}x{} {} {} {} {} {} {}", frame.name, size.width, size.height, frame.jitter.x,
                            frame.jitter.y, frame.exposure, frame.near_plane, frame.far_plane, frame.reset);
        for (const auto& [kind, file] : frame.optional) text += " " + kind;
        text += '\n';
    }
    return hexadecimal(
        hash_of_parts({text, first < next ? io::read_file(sequence.frames[next - 1].color) : std::string()}));
}

void write_run_state(const std::filesystem::path& file, const RunState& state) {
    Metadata metadata{{"form", kForm},
                      {"first", std::to_string(state.first)},
                      {"next", std::to_string(state.next)},
                      {"frames", state.frames}};
    for (const auto& [name, value] : state.settings) metadata[std::string(kSetting) + name] = value;
    metadata["hash"] = digest_of(metadata, state.upscaler, state.interpolator);
    const auto tensor = [](const std::vector<std::byte>& bytes) {
        return io::NewTensor::of(io::DataType::i8, {static_cast<int64_t>(bytes.size())},
                                 std::span<const std::byte>(bytes));
    };
    io::write_safetensors(file, metadata,
                          {{"upscaler", tensor(state.upscaler)}, {"interpolator", tensor(state.interpolator)}});
}

std::optional<RunState> read_run_state(const std::filesystem::path& file) {
    std::error_code none;
    if (!std::filesystem::exists(std::filesystem::symlink_status(file, none))) return std::nullopt;
    try {
        return state_of(io::Safetensors::read(file));
    } catch (const Error& error) {
        fail(error.kind(), "{}; {}", error.what(), kWayOut);
    }
}

void check_run_state(const std::filesystem::path& file, const RunState& state,
                     const std::map<std::string, std::string>& settings, const io::Sequence& sequence) {
    std::set<std::string> names;
    for (const auto& [name, value] : state.settings) names.insert(name);
    for (const auto& [name, value] : settings) names.insert(name);
    const auto value_in = [](const std::map<std::string, std::string>& all, const std::string& name) {
        const auto found = all.find(name);
        return found == all.end() ? std::string("none") : found->second;
    };
    std::vector<std::string> differences;
    for (const std::string& name : names) {
        const std::string before = value_in(state.settings, name), now = value_in(settings, name);
        if (before != now) differences.push_back(fmt::format("{} was {} and is {}", name, before, now));
    }
    if (!differences.empty())
        fail(ErrorKind::invalid_argument,
             "{} is the state of another run: {}; --resume goes on with the settings that a run had; {}", file.string(),
             fmt::join(differences, "; "), kWayOut);
    if (state.next > sequence.frames.size() || state.frames != digest_of(sequence, state.first, state.next))
        fail(
            ErrorKind::invalid_argument,
            "{} is the state of a run over another sequence: what {} says, or its frames from {} to before {}, are not "
            "those that were upscaled; {}",
            file.string(), sequence.folder.string(), state.first, state.next, kWayOut);
}

}  // namespace clarus::cli
