#include "base/error.h"
#include "io/image_folder.h"
#include "io/native.h"
#include "io/nss.h"
#include "io/output_layout.h"
#include "io/qrisp.h"
#include "io/sequence.h"
#include "io/video_reader.h"

// Apart from what a sequence is: the library knows that, and reads none.

namespace clarus::io {
namespace {

Layout guess(const std::filesystem::path& path) {
    if (path.filename() == "sequence.json" || exists(path / "sequence.json")) return Layout::native;
    if (looks_like_qrisp(path)) return Layout::qrisp;
    if (path.extension() == ".json" && is_directory(path.parent_path() / "ground_truth")) return Layout::nss;
    if (path.extension() == ".json" && is_regular_file(path) && looks_native(path)) return Layout::native;
    if (holds_images(path)) return Layout::images;
    if (exists(path) && is_video_input(path))
        fail(
            ErrorKind::file,
            "{} is a video, which `clarus upscale` alone reads; elsewhere name a folder of its pictures (`ffmpeg -i {} "
            "pictures/%04d.png`)",
            path.string(), path.string());
    if (!exists(path)) fail(ErrorKind::file, "cannot read the sequence {}: no such file or folder", path.string());
    fail(ErrorKind::file,
         "cannot tell the layout of the sequence {}{}: name it (native: a folder with sequence.json; qrisp: "
         "<scene>/<540p|360p|270p>/MipBias…Jittered/<segment>; nss: <dataset>/<sequence>.json; images: a folder of "
         "them, or one)",
         path.string(), is_directory(path) ? ", which has neither sequence.json nor images of its own" : "");
}

}  // namespace

Sequence read_sequence(const std::filesystem::path& path, Layout layout, double scale) {
    try {
        if (layout == Layout::guess) layout = guess(path);
        if (layout == Layout::qrisp) return read_qrisp(path);
        if (layout == Layout::nss) return read_nss(path, scale);
        if (layout == Layout::images) return read_images(path, scale);
        return read_native(is_directory(path) ? path / "sequence.json" : path);
    } catch (const std::filesystem::filesystem_error& error) {
        fail(ErrorKind::file, "cannot read {}: {}", error.path1().string(), error.code().message());
    }
}

std::unique_ptr<OutputLayout> output_layout(const std::filesystem::path& path, Layout layout) {
    if (layout == Layout::qrisp) return qrisp_output(path);
    if (layout == Layout::nss) return nss_output(path);
    return native_output(path);
}

}  // namespace clarus::io
