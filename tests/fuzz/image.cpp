#include "io/image.h"

#include "clarus/error.h"
#include "input_file.h"

using namespace clarus;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    // The reader goes by the name first, so both are tried.
    for (const char* name : {"image.png", "image.exr"}) {
        try {
            const auto path = input_file(name, data, size);
            const auto header = io::read_image_header(path, 4);
            // A larger one is legal and slow: what is looked for is in the decoding.
            if (int64_t{header.size.width} * header.size.height <= 1 << 20) io::read_image(path, 4);
        } catch (const Error&) {
        }
    }
    // Depth, motion and colour of the EXR's channels, and a part.
    const auto path = input_file("image.exr", data, size);
    for (const io::ChannelNames& named : {io::ChannelNames{}, io::ChannelNames{"depth", {}}})
        for (const int most : {1, 2, 3}) {
            try {
                io::read_image_header(path, most, named);
            } catch (const Error&) {
            }
        }
    return 0;
}
