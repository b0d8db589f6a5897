#include <doctest/doctest.h>

#include <algorithm>
#include <filesystem>
#include <initializer_list>
#include <set>
#include <string>
#include <vector>

#include "io/file.h"
#include "io/image.h"
#include "noise_sequence.h"
#include "run_clarus.h"
#include "temporary_folder.h"
#include "test_device.h"

// `clarus upscale -o FILE.png` as a process.

using namespace clarus;
using namespace clarus::test;
namespace fs = std::filesystem;

namespace {

class Workplace {
  public:
    explicit Workplace(ColorSpace color_space = ColorSpace::srgb) {
        write_noise_sequence(folder_ / "sequence", {12, 8}, 3, color_space);
    }
    fs::path operator/(const fs::path& name) const { return folder_ / name; }

    Outcome upscale(const fs::path& input, const fs::path& output, const std::vector<std::string>& more = {}) const {
        std::vector<std::string> all{"upscale",  folder_ / input, "--model",  "bicubic",
                                     "--device", test_selector(), "--output", folder_ / output};
        all.insert(all.end(), more.begin(), more.end());
        return run_clarus(all);
    }
    void refuses(const fs::path& input, const fs::path& output, const std::vector<std::string>& more,
                 const std::string& words) const {
        const Outcome outcome = upscale(input, output, more);
        CHECK(outcome.code == 1);
        CHECK_MESSAGE(outcome.errors.find(words) != std::string::npos, outcome.errors);
        CHECK_FALSE(fs::exists(folder_ / "one.png"));
    }

  private:
    TemporaryFolder folder_;
};

/// Of RGB, with three tags: PNG files are read without those that have fewer.
std::vector<unsigned char> icc_profile() {
    constexpr unsigned char tags = 3, tag_bytes = 20, begin = 128 + 4 + 12 * tags;
    std::vector<unsigned char> profile(begin + tags * tag_bytes);
    const auto put = [&](size_t at, std::initializer_list<unsigned char> bytes) {
        std::ranges::copy(bytes, profile.begin() + static_cast<std::ptrdiff_t>(at));
    };
    put(3, {static_cast<unsigned char>(profile.size())});
    put(8, {4, 0x30});
    put(12, {'m', 'n', 't', 'r', 'R', 'G', 'B', ' ', 'X', 'Y', 'Z', ' '});
    put(36, {'a', 'c', 's', 'p'});
    put(68, {0, 0, 0xf6, 0xd6, 0, 1, 0, 0, 0, 0, 0xd3, 0x2d});  // D50
    put(131, {tags});
    for (unsigned char tag = 0; tag < tags; ++tag) {
        const unsigned char at = begin + tag * tag_bytes;
        put(132 + size_t{12} * tag, {'w', 't', 'p', 't', 0, 0, 0, at, 0, 0, 0, tag_bytes});
        put(at, {'X', 'Y', 'Z', ' ', 0, 0, 0, 0, 0, 0, 0xf6, 0xd6, 0, 1, 0, 0, 0, 0, 0xd3, 0x2d});
    }
    return profile;
}

}  // namespace

TEST_CASE("one frame is written as the picture that --output names, and nothing else") {
    const Workplace place;
    REQUIRE(place.upscale("sequence", "folder").code == 0);
    const std::string expected = io::read_file(place / "folder/0001.png");
    const Outcome of_sequence = place.upscale("sequence", "made/one.png", {"--frames", "1:2"});
    REQUIRE_MESSAGE(of_sequence.code == 0, of_sequence.errors);
    CHECK(io::read_file(place / "made/one.png") == expected);
    const Outcome of_image = place.upscale("sequence/color/0001.png", "made/image.png");
    REQUIRE_MESSAGE(of_image.code == 0, of_image.errors);
    CHECK(io::read_file(place / "made/image.png") == expected);
    std::set<std::string> names;
    for (const auto& entry : fs::directory_iterator(place / "made")) names.insert(entry.path().filename());
    CHECK(names == std::set<std::string>{"one.png", "image.png"});

    // An image may have its result beside it.
    CHECK(place.upscale("sequence/color/0001.png", "sequence/color/larger.exr").code == 0);
    CHECK(fs::file_size(place / "sequence/color/larger.exr") > 24 * 16 * 4);
    CHECK(place.upscale("sequence/color/0002.png", "made/LARGE.PNG").code == 0);
    CHECK(fs::is_regular_file(place / "made/LARGE.PNG"));
}

TEST_CASE("what colours mean is kept") {
    const Workplace place;
    const auto tags_of_result = [&](const fs::path& image, const io::ColorTags& tags, const fs::path& result) {
        const io::Pixels pixels = noise({12, 8}, 3, 0, 1, 5);
        write_image(place / image, pixels, image.extension() == ".exr" ? io::SampleType::f16 : io::SampleType::u8,
                    io::default_png_compression, tags);
        const Outcome outcome = place.upscale(image, result);
        CHECK_MESSAGE(outcome.code == 0, outcome.errors);
        return io::read_image_header(place / result).tags;
    };
    io::ColorTags profile;
    profile.icc = icc_profile();
    CHECK(tags_of_result("wide.png", profile, "wide_x2.png") == profile);
    for (const float power : {1.8f, 1.0f}) {
        io::ColorTags gamma;
        gamma.gamma = power;
        CHECK(tags_of_result("gamma.png", gamma, "gamma_x2.png").gamma == doctest::Approx(power));
    }
    io::ColorTags primaries;
    primaries.chromaticities = {0.708f, 0.292f, 0.17f, 0.797f, 0.131f, 0.046f, 0.3127f, 0.329f};
    CHECK(tags_of_result("wide.exr", primaries, "wide_x2.exr") == primaries);
    CHECK(tags_of_result("none.png", {}, "none_x2.png") == io::ColorTags{});

    // A profile that is damaged means nothing, and is no reason to lose the picture.
    profile.icc.resize(100);
    CHECK(tags_of_result("damaged.jpg", profile, "damaged_x2.png").icc.empty());
}

TEST_CASE("what one picture cannot hold, or would replace, is refused") {
    const Workplace place;
    place.refuses("sequence", "one.png", {}, "one.png is one picture, and 3 frames would be made");
    place.refuses("sequence", "one.png", {"--frames", "0:1", "--frame-rate", "x2"}, "--frame-rate x2 writes more");
    place.refuses("sequence", "one.png", {"--frames", "0:1", "--view", "x"}, "--view writes more");
    place.refuses("sequence", "one.png", {"--frames", "0:1", "--resume"}, "--resume writes more");
    place.refuses("sequence", "one.png", {"--frames", "0:1", "--save-every", "3"}, "--save-every writes more");
    place.refuses("sequence", "one.png", {"--frames", "0:1", "--format", "exr"}, "leave it out");
    place.refuses("sequence", "one.png", {"--frames", "0:1", "--crf", "3"}, "--crf is of videos");
    place.refuses("sequence", "one.png", {"--frames", "0:1", "--bits", "32"}, "name an .exr file");
    place.refuses("sequence", "one.exr", {"--frames", "0:1", "--bits", "8"}, "name a .png file");
    place.refuses("sequence", "one.jpg", {"--frames", "0:1"}, "of one frame a .png or .exr file");
    REQUIRE(place.upscale("sequence", "run", {"--frames", "0:1"}).code == 0);
    place.refuses("sequence", "run/0001.png", {"--frames", "1:2"}, "in a folder whose frames");
    place.refuses("sequence", "sequence/color/one.png", {"--frames", "0:1"}, "among the sequence's own files");
    place.refuses("sequence/color/0001.png", "sequence/color/0001.png", {}, "would replace the sequence");
    place.refuses("sequence/color/0001.png", "one.png", {"--report", place / "one.png"}, "would replace --output");
    const Workplace linear(ColorSpace::linear);
    linear.refuses("sequence", "one.png", {"--frames", "0:1"}, "name an .exr file");
    CHECK(linear.upscale("sequence", "one.exr", {"--frames", "0:1"}).code == 0);
}
