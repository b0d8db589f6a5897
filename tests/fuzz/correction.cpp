#include <algorithm>
#include <filesystem>
#include <vector>

#include "clarus/error.h"
#include "cli/check_correction.h"
#include "input_file.h"
#include "io/sequence.h"

using namespace clarus;

namespace {

/// Everything that `clarus check` may find wrong of such a sequence, of what it has alone; at last nothing.
std::vector<check::Correction> corrections_of(const io::Sequence& sequence) {
    const auto has = [&](std::filesystem::path io::FrameFiles::*image) {
        return std::ranges::any_of(sequence.frames, [&](const auto& frame) { return !(frame.*image).empty(); });
    };
    std::vector<check::Correction> corrections(3);
    corrections[2].reading = check::declared_reading(sequence);
    corrections[0].reading = {check::Unit::uv, true, true, true, 1, true, true, true, true, 1};
    corrections[0].color_space = ColorSpace::srgb;
    for (size_t i = sequence.frames.size(); i-- > 0;) corrections[0].order.push_back(i);
    corrections[0].unsayable = {"what is wrong"};
    corrections[1].reading = {check::Unit::pixels, false, false, false, -1, false, false, false, false, -1};
    corrections[1].color_space = ColorSpace::linear;
    corrections[1].no_jitter = true;
    for (const int i : {0, 1}) {
        if (!has(&io::FrameFiles::motion)) corrections[i].reading.motion_frame = 0;
        if (!has(&io::FrameFiles::depth)) continue;
        corrections[i].depth_projective = corrections[i].depth_reversed = i == 0;
        corrections[i].depth_frame = 1 - 2 * i;
    }
    return corrections;
}

}  // namespace

/// What `clarus check --fix` makes of a description that was read.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const auto path = input_file("sequence.json", data, size);
    io::Sequence sequence;
    try {
        sequence = io::read_sequence(path, io::Layout::native);
    } catch (const Error&) {
        return 0;
    }
    const std::filesystem::path corrected = cli::corrected_name(path);
    try {
        // Where nothing was wrong comes last: it is still a description.
        for (const check::Correction& correction : corrections_of(sequence))
            cli::write_correction(path, corrected, correction, 0);
    } catch (const Error&) {
        return 0;
    }
    io::read_sequence(corrected, io::Layout::native);
    return 0;
}
