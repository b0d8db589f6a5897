#include "metrics/vmaf.h"

#include <array>
#include <charconv>
#include <cstdint>
#include <string>

#include "base/error.h"
#include "metrics/display.h"

namespace clarus::metrics {
namespace {

// Takes width and height, then pairs of images in 8 bits, each after a 1, then a 0; answers with a line before, and in
// the end with one for each frame. Both images of a pair go to FFmpeg as one, the reference below, for it has one
// input.
constexpr const char* script = R"(
import json, os, shutil, struct, subprocess, sys, tempfile
answers = os.fdopen(os.dup(1), "w")
os.dup2(2, 1)
def candidates():
    try:
        import imageio_ffmpeg
        yield imageio_ffmpeg.get_ffmpeg_exe()
    except (ImportError, RuntimeError):
        pass
    yield shutil.which("ffmpeg")
def has_vmaf(program):
    filters = program and subprocess.run([program, "-hide_banner", "-filters"], capture_output=True, text=True).stdout
    return filters and "libvmaf" in filters
ffmpeg = next(filter(has_vmaf, candidates()), None)
print("ready" if ffmpeg else "none has libvmaf", file=answers, flush=True)
header = sys.stdin.buffer.read(8)
if ffmpeg and header:
    width, height = struct.unpack("ii", header)
    log = tempfile.NamedTemporaryFile(prefix="clarus-vmaf-")
    luma = "scale=out_color_matrix=bt709:out_range=tv:flags=accurate_rnd,format=yuv444p"
    graph = (f"split[both][below];[both]crop={width}:{height}:0:0,{luma}[image];"
             f"[below]crop={width}:{height}:0:{height},{luma}[reference];"
             f"[image][reference]libvmaf=n_threads={os.cpu_count()}:log_fmt=json:log_path={log.name}")
    process = subprocess.Popen(
        [ffmpeg, "-v", "error", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{2 * height}", "-i", "-",
         "-lavfi", graph, "-f", "null", "-"], stdin=subprocess.PIPE, stdout=subprocess.DEVNULL)
    try:
        while sys.stdin.buffer.read(1) == b"\1":
            process.stdin.write(sys.stdin.buffer.read(6 * width * height))
        process.stdin.close()
    except BrokenPipeError:
        pass
    if process.wait() == 0:
        for frame in json.load(log)["frames"]:
            print(frame["metrics"]["vmaf"], file=answers)
    answers.flush()
)";

std::vector<uint8_t> bytes_of(const io::Pixels& image) {
    std::vector<uint8_t> bytes;
    bytes.reserve(image.values.size());
    for (const float value : image.values) bytes.push_back(static_cast<uint8_t>(value * 255 + 0.5f));
    return bytes;
}

}  // namespace

Vmaf::Vmaf() : python_(script, {}) {
    if (const std::string answer = python_.receive_line(); answer != "ready")
        fail(ErrorKind::invalid_argument,
             "VMAF needs an FFmpeg with libvmaf ({}); in a virtual environment: python3 -m venv vmaf && vmaf/bin/pip "
             "install imageio-ffmpeg && PATH=$PWD/vmaf/bin:$PATH clarus compare --vmaf …",
             answer.empty() ? "python3 ended" : answer);
}

void Vmaf::add(const io::Pixels& image, const io::Pixels& reference) {
    require_comparable(image, reference);
    if (!size_) {
        size_ = image.size;
        const std::array<int32_t, 2> size{image.size.width, image.size.height};
        python_.send(size.data(), sizeof size);
    }
    if (image.size != *size_)
        fail(ErrorKind::invalid_argument, "VMAF is of sequences of one size: {}x{} follows {}x{}", image.size.width,
             image.size.height, size_->width, size_->height);
    constexpr char more = 1;
    python_.send(&more, 1);
    for (const io::Pixels* pixels : {&image, &reference}) {
        const std::vector<uint8_t> bytes = bytes_of(*pixels);
        python_.send(bytes.data(), bytes.size());
    }
    ++frames_;
}

std::vector<double> Vmaf::finish() {
    constexpr char end = 0;
    python_.send(&end, 1);
    std::vector<double> figures(frames_);
    for (double& figure : figures) {
        const std::string line = python_.receive_line();
        if (std::from_chars(line.data(), line.data() + line.size(), figure).ec != std::errc{})
            fail(ErrorKind::file, "FFmpeg ended without a figure for VMAF; what it says is above");
    }
    return figures;
}

}  // namespace clarus::metrics
