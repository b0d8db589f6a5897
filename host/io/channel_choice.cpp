#include "io/channel_choice.h"

#include <algorithm>
#include <array>
#include <map>
#include <span>
#include <utility>

#include "base/error.h"
#include "base/lower_case.h"

namespace clarus::io {
namespace {

/// Kinds of channels that together are what is asked for.
struct Kinds {
    std::vector<std::string> names;
    /// Whether they are that wherever they are found. Others are, too, in a layer that is named so, or where the file
    /// has nothing else: R of a picture with colours is not its depth.
    bool tell_alone = false;
};

/// How renderers name what is asked for by a number of channels: depth by one, motion by two, colour by three.
struct Role {
    const char* name;
    std::vector<Kinds> kinds;        // the best first
    std::vector<std::string> words;  // of layers
    bool prefers_words;              // to what is in no layer
};

const Role& role_of(int channels) {
    static const std::array<Role, 3> roles{
        {{"depth", {{{"z"}, true}, {{"depth"}, true}, {{"v"}}, {{"y"}}, {{"r"}}}, {"depth"}, true},
         {"motion", {{{"x", "y"}}, {{"u", "v"}}, {{"r", "g"}}}, {"vector", "velocity", "motion", "forward"}, true},
         {"colour",
          {{{"r", "g", "b"}, true}, {{"red", "green", "blue"}, true}},
          {"combined", "beauty", "rgb", "color", "colour", "final"},
          false}}};
    return roles.at(static_cast<size_t>(channels) - 1);
}

[[noreturn]] void refuse(const Role& role, const std::vector<Channel>& channels, const std::filesystem::path& path) {
    fail(ErrorKind::file,
         "cannot read image {}: which of its channels are {}? There are {}. Name those that are meant as `channels` in "
         "the sequence's JSON (docs/formats.md), or write them into a file of their own",
         path.string(), role.name, listing(channels));
}

/// Whether the file holds one thing only: a layer, of which alpha and a third component of a map may be the rest.
bool is_one_layer(const std::vector<Channel>& channels) {
    static const std::array<std::string_view, 13> together{"r", "g", "b",   "a",     "x",    "y",    "z",
                                                           "u", "v", "red", "green", "blue", "alpha"};
    return std::ranges::all_of(channels, [&](const Channel& channel) {
        const bool is_vector = channel.kind != "z" ||
                               std::ranges::any_of(channels, [](const Channel& other) { return other.kind == "x"; });
        return channel.part == channels.front().part && channel.layer == channels.front().layer && is_vector &&
               std::ranges::find(together, channel.kind) != together.end();
    });
}

/// Errors: file, where none is known to be that, or several layers may be.
std::vector<Channel> by_role(const std::vector<Channel>& channels, int most, const std::filesystem::path& path) {
    const Role& role = role_of(most);
    using Layers = std::vector<std::vector<Channel>>;
    const auto has = [&](const Channel& beside, std::string_view kind) {
        return std::ranges::any_of(channels, [&](const Channel& other) {
            return other.kind == kind && other.part == beside.part && other.layer == beside.layer;
        });
    };
    const auto is_of_vector = [&](const Channel& channel) {
        return channel.kind == "z" && has(channel, "x") && has(channel, "y");
    };
    const auto layers_of = [&](const Kinds& kinds) {
        std::map<std::pair<int, std::string>, std::vector<Channel>> layers;
        for (const std::string& kind : kinds.names)
            for (const Channel& channel : channels)
                if (channel.kind == kind && !is_of_vector(channel))
                    layers[{channel.part, channel.layer}].push_back(channel);
        Layers whole;
        for (const auto& [where, layer] : layers)
            if (layer.size() == kinds.names.size()) whole.push_back(layer);
        return whole;
    };
    const bool alone = is_one_layer(channels);
    const auto is_named_so = [&](const std::string& layer) {
        return std::ranges::any_of(role.words, [&](const std::string& word) { return layer.find(word) != layer.npos; });
    };
    enum class Where { named_so, in_no_layer, anywhere };
    const auto fits = [&](const std::vector<Channel>& layer, Where where) {
        const std::string& name = layer.front().layer;
        return where == Where::named_so ? is_named_so(name) : where == Where::anywhere || name.empty();
    };
    const std::array<Where, 3> order{role.prefers_words ? Where::named_so : Where::in_no_layer,
                                     role.prefers_words ? Where::in_no_layer : Where::named_so, Where::anywhere};
    for (const Where where : order)
        for (const Kinds& kinds : role.kinds) {
            if (where != Where::named_so && !kinds.tell_alone && !alone) continue;
            // Three colours in a layer of another name are albedo, normals, light of one kind.
            if (where == Where::anywhere && kinds.names.size() == 3 && !alone) continue;
            Layers layers = layers_of(kinds);
            std::erase_if(layers, [&](const auto& layer) { return !fits(layer, where); });
            if (layers.size() == 1) return layers.front();
            if (layers.size() > 1) refuse(role, channels, path);
        }
    refuse(role, channels, path);
}

/// With the alpha of the same layer, where it has one.
std::vector<Channel> color_with_alpha(const std::vector<Channel>& channels, const std::filesystem::path& path) {
    std::vector<Channel> color = by_role(channels, 3, path);
    const Channel red = color.front();
    const auto alpha = std::ranges::find_if(channels, [&](const Channel& channel) {
        const bool is_alpha = channel.kind == "a" || channel.kind == "alpha";
        return is_alpha && channel.part == red.part && channel.layer == red.layer;
    });
    if (alpha != channels.end()) color.push_back(*alpha);
    return color;
}

/// Errors: file, where there are no such channels, or several of them.
std::vector<Channel> by_name(const std::vector<Channel>& channels, std::span<const std::string> names,
                             const std::filesystem::path& path) {
    std::map<int, std::vector<Channel>> found;  // in each part
    for (const std::string& name : names) {
        bool is_there = false;
        for (const Channel& channel : channels)
            if (channel.name == name) found[channel.part].push_back(channel), is_there = true;
        if (!is_there)
            fail(ErrorKind::file, "cannot read image {}: it has no channel {}; there are {}", path.string(), name,
                 listing(channels));
    }
    std::erase_if(found, [&](const auto& part) { return part.second.size() != names.size(); });
    if (found.size() != 1)
        fail(ErrorKind::file, "cannot read image {}: {} has all of the named channels; there are {}", path.string(),
             found.empty() ? "no part" : "more than one `part`", listing(channels));
    return found.begin()->second;
}

}  // namespace

Channel channel_of(int part, int place, const std::string& part_name, const std::string& name) {
    const size_t dot = name.rfind('.');
    const bool has_layer = dot != std::string::npos;
    return {part,
            place,
            part_name,
            name,
            lower_case(has_layer ? name.substr(0, dot) : part_name),
            lower_case(has_layer ? name.substr(dot + 1) : name)};
}

std::string listing(const std::vector<Channel>& channels) {
    std::string names;
    for (const Channel& channel : channels)
        names +=
            (names.empty() ? "" : ", ") + (channel.part_name.empty() ? "" : channel.part_name + ":") + channel.name;
    return names;
}

std::optional<std::vector<Channel>> chosen_channels(std::vector<Channel> channels, int most, const ChannelNames& named,
                                                    const std::filesystem::path& path) {
    if (!named.part.empty()) {
        const std::string all = listing(channels);
        std::erase_if(channels, [&](const Channel& channel) { return channel.part_name != named.part; });
        if (channels.empty())
            fail(ErrorKind::file, "cannot read image {}: it has no part {}; there are {}", path.string(), named.part,
                 all);
    }
    if (!named.names.empty()) return by_name(channels, named.names, path);
    const size_t roles = most == 4 ? 3 : static_cast<size_t>(most);  // alpha comes by its colour
    if (most >= 1 && most <= 4 && channels.size() > roles)
        return most == 4 ? color_with_alpha(channels, path) : by_role(channels, most, path);
    if (named.part.empty()) return std::nullopt;
    channels.resize(std::min(channels.size(), static_cast<size_t>(most)));
    return channels;
}

}  // namespace clarus::io
