#include "clarus/error.h"
#include "input_file.h"
#include "io/video_reader.h"

using namespace clarus;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    // Larger ones, and longer, are legal and slow: what is looked for is in how they are taken apart.
    constexpr size_t largest_file = 1 << 16;
    constexpr int64_t most_pixels = 1 << 18;
    constexpr int most_pictures = 8;
    if (size > largest_file) return 0;
    try {
        const auto video = io::open_video(input_file("video.mp4", data, size));
        const Size picture = video->facts().size;
        if (int64_t{picture.width} * picture.height > most_pixels) return 0;
        for (int i = 0; i < most_pictures && video->next(); ++i) continue;
    } catch (const Error&) {
    }
    return 0;
}
