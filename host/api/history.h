#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "clarus/types.h"
#include "runtime/program.h"

namespace clarus {

/// What a stream keeps of its frames for the next one.
struct History {
    Size render_size;         // of the last frame
    Vec2 jitter;              // likewise
    std::string computed_by;  // devices and kernels, on which the last bits of values depend
    std::vector<runtime::KeptValue> values;
    bool starts_anew = true;  // there is no history: the next frame is a reset, and what is above says nothing
};

/// As bytes, in the form of a safetensors file: a tensor a value, of the device's own type. `network` says what it is
/// the history of.
std::vector<std::byte> bytes_of(const History& history, const std::string& network);
/// The opposite. Errors: invalid_argument, where the bytes are no history or are that of another network.
History history_of(std::span<const std::byte> bytes, const std::string& network);

}  // namespace clarus
