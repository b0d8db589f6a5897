#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/image.h"

// Which channels of an OpenEXR file are meant: docs/formats.md, "Channels".
namespace clarus::io {

/// A channel of a file: "ViewLayer.Vector.X" is x of the layer viewlayer.vector.
struct Channel {
    int part, place;  // from 0; the place among the part's channels
    std::string part_name, name, layer, kind;
};

/// `name` as it is in the file. What has no layer in it has its part's, where there are several parts.
Channel channel_of(int part, int place, const std::string& part_name, const std::string& name);

/// The channels' names, for messages.
std::string listing(const std::vector<Channel>& channels);

/// The channels to read of all that a file has, in their order: those that are named; or, at most so many, by what
/// renderers call them: one is depth, two are motion, three colour, four colour with its alpha where it has one. None
/// where the file has no more than are asked for and nothing is named: the first ones. Errors: file, with the list,
/// where several may be meant, none is of that name, or none that is there is known to be what is asked for.
std::optional<std::vector<Channel>> chosen_channels(std::vector<Channel> channels, int most, const ChannelNames& named,
                                                    const std::filesystem::path& path);

}  // namespace clarus::io
