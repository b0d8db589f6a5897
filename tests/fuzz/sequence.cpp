#include "io/sequence.h"

#include <filesystem>
#include <vector>

#include "clarus/error.h"
#include "input_file.h"
#include "io/image.h"

using namespace clarus;

/// The colours of an NSS capture of two frames, which are read before its JSON is.
static void write_colors(const std::filesystem::path& folder) {
    std::filesystem::create_directories(folder);
    for (const char* name : {"0000.exr", "0001.exr"})
        io::write_image(folder / name, {{16, 8}, 3, std::vector<float>(16 * 8 * 3, 0.5f)}, io::SampleType::f16);
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const auto path = input_file("sequence.json", data, size);
    [[maybe_unused]] static const bool has_colors = (write_colors(path.parent_path() / "x2/color/sequence"), true);
    for (const auto layout : {io::Layout::native, io::Layout::nss}) {
        try {
            const auto sequence = io::read_sequence(path, layout);
            sequence.output_size();
            sequence.motion_encoding();
            for (const auto& frame : sequence.frames) sequence.motion_scale(frame);
        } catch (const Error&) {
        }
    }
    return 0;
}
