#include <cstddef>
#include <cstdint>
#include <fstream>

#include "clarus/error.h"
#include "io/sequence.h"
#include "temporary_folder.h"

using namespace clarus;

namespace {

/// A segment of QRISP's layout whose first frame's camera is the input.
class Segment {
  public:
    Segment() {
        for (const auto& folder : {images(), camera().parent_path()}) std::filesystem::create_directories(folder);
        std::ofstream(images() / "0000.png");
    }
    std::filesystem::path images() const { return folder_ / "270p" / "MipBiasMinus1Jittered" / "0000"; }
    std::filesystem::path camera() const { return folder_ / "270p" / "CameraData" / "0000" / "0000.json"; }

  private:
    TemporaryFolder folder_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    static const Segment segment;
    std::ofstream(segment.camera(), std::ios::binary)
        .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
    try {
        io::read_sequence(segment.images(), io::Layout::qrisp);
    } catch (const Error&) {
    }
    return 0;
}
