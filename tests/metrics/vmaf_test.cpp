#include "metrics/vmaf.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <string>

#include "clarus/error.h"
#include "noise_sequence.h"
#include "temporary_folder.h"

using namespace clarus;
using namespace clarus::test;
namespace fs = std::filesystem;

namespace {

/// A folder with stand-ins of python3 and ffmpeg in front of the path, as long as it lives.
class Path {
  public:
    Path() : before_(std::getenv("PATH")) { setenv("PATH", (folder_.path().string() + ":" + before_).c_str(), 1); }
    ~Path() { setenv("PATH", before_.c_str(), 1); }
    Path(const Path&) = delete;
    Path& operator=(const Path&) = delete;

    void add(const std::string& name, const std::string& text) const {
        std::ofstream(folder_ / name) << text;
        fs::permissions(folder_ / name, fs::perms::owner_all);
    }

  private:
    TemporaryFolder folder_;
    std::string before_;
};

// Its figure is 100 less the largest difference of the upper half and the lower, in 8-bit levels.
constexpr const char* stand_in = R"PYTHON(#!/usr/bin/python3
import json, re, sys
if "-filters" in sys.argv:
    sys.exit(print(" .. libvmaf"))
graph = sys.argv[sys.argv.index("-lavfi") + 1]
width, height = map(int, re.search(r"crop=(\d+):(\d+):0:0,", graph).groups())
assert sys.argv[sys.argv.index("-s") + 1] == f"{width}x{2 * height}"
frames = []
while both := sys.stdin.buffer.read(6 * width * height):
    half = len(both) // 2
    assert half == 3 * width * height
    frames.append({"metrics": {"vmaf": 100 - max(abs(a - b) for a, b in zip(both[:half], both[half:]))}})
json.dump({"frames": frames}, open(re.search("log_path=(.*)", graph).group(1), "w"))
)PYTHON";

std::string refused() {
    try {
        metrics::Vmaf();
    } catch (const Error& error) {
        return error.what();
    }
    return "";
}

}  // namespace

TEST_CASE("VMAF is FFmpeg's, of all frames in order") {
    const Path path;
    // Whatever packages the machine's python3 has.
    path.add("python3", "#!/bin/sh\nexec /usr/bin/python3 -S \"$@\"\n");
    path.add("ffmpeg", stand_in);
    metrics::Vmaf vmaf;
    std::vector<double> expected;
    for (unsigned i = 0; i < 5; ++i) {
        const io::Pixels image = noise({17, 9}, 3, 0, 0.1f * static_cast<float>(i + 1), 2 * i);
        const io::Pixels reference = noise({17, 9}, 3, 0, 0.2f, 2 * i + 1);
        vmaf.add(image, reference);
        int largest = 0;
        for (size_t k = 0; k < image.values.size(); ++k)
            largest = std::max(largest, std::abs(static_cast<int>(image.values[k] * 255 + 0.5f) -
                                                 static_cast<int>(reference.values[k] * 255 + 0.5f)));
        expected.push_back(100 - largest);
    }
    CHECK_THROWS_WITH(vmaf.add(noise({16, 9}, 3, 0, 1, 1), noise({16, 9}, 3, 0, 1, 1)),
                      "VMAF is of sequences of one size: 16x9 follows 17x9");
    CHECK(vmaf.finish() == expected);
}

TEST_CASE("where FFmpeg cannot, VMAF says so") {
    const Path path;
    path.add("python3", "#!/bin/sh\nexec /usr/bin/python3 -S \"$@\"\n");
    path.add("ffmpeg", "#!/bin/sh\necho ' .. scale'\n");
    CHECK(refused().starts_with("VMAF needs an FFmpeg with libvmaf (none has libvmaf); in a virtual environment"));
    path.add("ffmpeg", "#!/bin/sh\n[ \"$2\" = -filters ] && echo libvmaf || exit 1\n");
    metrics::Vmaf vmaf;
    vmaf.add(noise({64, 64}, 3, 0, 1, 1), noise({64, 64}, 3, 0, 1, 2));
    CHECK_THROWS_WITH(vmaf.finish(), "FFmpeg ended without a figure for VMAF; what it says is above");
    path.add("python3", "#!/bin/sh\nexit 1\n");
    CHECK(refused().find("(python3 ended)") != std::string::npos);
}
