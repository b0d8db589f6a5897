#include "io/sequence.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "io/image_folder.h"
#include "io/native.h"
#include "io/nss.h"
#include "io/output_layout.h"
#include "io/qrisp.h"

namespace clarus::io {
namespace {

Layout guess(const std::filesystem::path& path) {
    if (path.filename() == "sequence.json" || exists(path / "sequence.json")) return Layout::native;
    if (looks_like_qrisp(path)) return Layout::qrisp;
    if (path.extension() == ".json" && is_directory(path.parent_path() / "ground_truth")) return Layout::nss;
    if (path.extension() == ".json" && is_regular_file(path) && looks_native(path)) return Layout::native;
    if (holds_images(path)) return Layout::images;
    if (!exists(path)) fail(ErrorKind::file, "cannot read the sequence {}: no such file or folder", path.string());
    fail(ErrorKind::file,
         "cannot tell the layout of the sequence {}: name it (native: a folder with sequence.json; qrisp: "
         "<scene>/<540p|360p|270p>/MipBias…Jittered/<segment>; nss: <dataset>/<sequence>.json; images: a folder of "
         "them, or one)",
         path.string());
}

}  // namespace

bool Sequence::is_dynamic() const {
    return std::any_of(frames.begin(), frames.end(),
                       [&](const FrameFiles& frame) { return render_size_of(frame) != render_size; });
}

bool Sequence::any_has(const std::string& optional) const {
    return std::any_of(frames.begin(), frames.end(),
                       [&](const FrameFiles& frame) { return frame.optional.contains(optional); });
}

MotionEncoding Sequence::motion_encoding() const {
    return {.scale = motion_scale({}), .jittered = motion.jittered, .sampled_at_jitter = motion.sampled_at_jitter};
}

Vec2 Sequence::motion_scale(const FrameFiles& frame) const {
    const bool uv = motion.unit == MotionUnit::uv;
    const Size size = render_size_of(frame);
    const float direction = motion.from_previous ? -1 : 1;
    return {direction * (uv ? size.width : 1), direction * (uv ? size.height : 1) * (motion.y_up ? -1 : 1)};
}

double Sequence::output_scale() const {
    if (!shown_size) return scale;
    const double across = static_cast<double>(shown_size->width) / render_size.width;
    return std::sqrt(across * shown_size->height / render_size.height);
}

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
