#include "io/image.h"

#include <OpenImageIO/imageio.h>
#include <doctest/doctest.h>
#include <signal.h>
#include <sys/resource.h>

#include <cmath>
#include <fstream>
#include <limits>

#include "clarus/error.h"
#include "io/file.h"
#include "temporary_folder.h"

using namespace clarus;
using namespace clarus::io;
using doctest::Contains;

namespace {

/// Values that are no multiple of anything, in [-0.25, 1.25].
Pixels test_image(Size size, int channels) {
    Pixels pixels{size, channels, {}};
    for (int i = 0; i < size.width * size.height * channels; ++i)
        pixels.values.push_back(static_cast<float>(i * 7919 % 1009) / 1008 * 1.5f - 0.25f);
    return pixels;
}

float clamped(float value) { return std::fmin(std::fmax(value, 0.0f), 1.0f); }

size_t files_in(const std::filesystem::path& folder) {
    return std::distance(std::filesystem::directory_iterator(folder), {});
}

/// Writes the first `keep` parts in 100 of a file to another.
void cut(const std::filesystem::path& from, const std::filesystem::path& to, size_t keep) {
    const std::string bytes = read_file(from);
    std::ofstream(to, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size() * keep / 100));
}

/// While it lives, no file of this process may grow beyond a size: the disk is full.
class FullDisk {
  public:
    explicit FullDisk(rlim_t size) {
        handler_ = signal(SIGXFSZ, SIG_IGN);
        getrlimit(RLIMIT_FSIZE, &before_);
        const rlimit limit{size, before_.rlim_max};
        setrlimit(RLIMIT_FSIZE, &limit);
    }
    ~FullDisk() {
        setrlimit(RLIMIT_FSIZE, &before_);
        signal(SIGXFSZ, handler_);
    }

  private:
    rlimit before_{};
    void (*handler_)(int);
};

}  // namespace

TEST_CASE("8- and 16-bit PNG hold the nearest step of the clamped value, alpha and colour apart") {
    const TemporaryFolder folder;
    for (const int channels : {1, 2, 3, 4}) {
        const Pixels image = test_image({37, 21}, channels);
        for (const auto& [type, top] : {std::pair{SampleType::u8, 255.0f}, {SampleType::u16, 65535.0f}}) {
            write_image(folder / "image.png", image, type);
            const ImageHeader header = read_image_header(folder / "image.png");
            CHECK(header.size == image.size);
            CHECK(header.channels == channels);
            const Pixels back = read_image(folder / "image.png");
            REQUIRE(back.values.size() == image.values.size());
            float worst = 0;
            for (size_t i = 0; i < back.values.size(); ++i)
                worst = std::fmax(worst,
                                  std::fabs(back.values[i] * top - std::floor(clamped(image.values[i]) * top + 0.5f)));
            CHECK(worst < 0.02f);
        }
    }
}

TEST_CASE("EXR holds floats exactly, beyond [0, 1] too, and halves to half's precision") {
    const TemporaryFolder folder;
    for (const int channels : {1, 2, 3, 4, 5}) {
        Pixels image = test_image({16, 9}, channels);
        image.values.front() = 1e6f;
        write_image(folder / "image.exr", image, SampleType::f32);
        const Pixels back = read_image(folder / "image.exr");
        CHECK(back.size == image.size);
        CHECK(back.channels == channels);
        CHECK(back.values == image.values);
        if (channels < 5) {  // of five, one is neither a colour nor alpha
            const Pixels first = read_image(folder / "image.exr", 1);
            CHECK(first.channels == 1);
            CHECK(first.at(15, 8, 0) == image.at(15, 8, 0));
        }

        image.values.front() = 1000;
        write_image(folder / "half.exr", image, SampleType::f16);
        const Pixels halves = read_image(folder / "half.exr");
        for (size_t i = 0; i < halves.values.size(); ++i)
            REQUIRE(halves.values[i] == doctest::Approx(image.values[i]).epsilon(1.0 / 2048));
    }
}

TEST_CASE("of an EXR that has fewer pixels than are shown, or others, what is shown is read") {
    const TemporaryFolder folder;
    const std::filesystem::path path = folder / "windows.exr";
    const std::vector<float> values(4 * 3 * 3, 0.5f);  // 4x3 pixels from (−1, 1) on, of a picture of 5x4 from (0, 0)
    OIIO::ImageSpec spec(4, 3, 3, OIIO::TypeDesc::FLOAT);
    spec.x = -1;
    spec.y = 1;
    spec.full_x = spec.full_y = 0;
    spec.full_width = 5;
    spec.full_height = 4;
    const auto output = OIIO::ImageOutput::create(path.string());
    REQUIRE(output->open(path.string(), spec));
    REQUIRE(output->write_image(OIIO::TypeDesc::FLOAT, values.data()));
    REQUIRE(output->close());

    CHECK(read_image_header(path).size == Size{5, 4});
    const Pixels pixels = read_image(path);
    REQUIRE(pixels.size == Size{5, 4});
    for (int y = 0; y < 4; ++y)
        for (int x = 0; x < 5; ++x) {
            CAPTURE(x);
            CAPTURE(y);
            CHECK(pixels.at(x, y, 1) == (x < 3 && y >= 1 ? 0.5f : 0));
        }
}

TEST_CASE("of an EXR's layers and parts those are read that are named so") {
    const TemporaryFolder folder;
    const std::filesystem::path path = folder / "layers.exr";
    // Every channel holds its number among all.
    const auto write = [&](const std::vector<std::pair<std::string, std::vector<std::string>>>& parts) {
        std::vector<OIIO::ImageSpec> specs;
        for (const auto& [name, channels] : parts) {
            OIIO::ImageSpec& spec = specs.emplace_back(3, 2, static_cast<int>(channels.size()), OIIO::TypeDesc::FLOAT);
            spec.channelnames = channels;
            spec.alpha_channel = spec.z_channel = -1;
            if (parts.size() > 1) spec.attribute("oiio:subimagename", name);
        }
        const auto output = OIIO::ImageOutput::create(path.string());
        REQUIRE(output->open(path.string(), static_cast<int>(specs.size()), specs.data()));
        float number = 0;
        for (size_t part = 0; part < specs.size(); ++part) {
            if (part > 0) REQUIRE(output->open(path.string(), specs[part], OIIO::ImageOutput::AppendSubimage));
            std::vector<float> values;
            for (int pixel = 0; pixel < 6; ++pixel)
                for (int c = 0; c < specs[part].nchannels; ++c) values.push_back(number + static_cast<float>(c));
            number += static_cast<float>(specs[part].nchannels);
            REQUIRE(output->write_image(OIIO::TypeDesc::FLOAT, values.data()));
        }
        REQUIRE(output->close());
    };
    const auto read = [&](int most) {
        const Pixels pixels = read_image(path, most);
        CHECK(pixels.channels == most);
        return std::vector<float>(pixels.values.end() - most, pixels.values.end());
    };
    using Values = std::vector<float>;

    write({{"", {"R", "G", "B", "A", "Z"}}});
    CHECK(read(3) == Values{0, 1, 2});
    CHECK(read(1) == Values{4});
    CHECK_THROWS_WITH_AS(read(2), Contains("which of its channels are motion? There are R, G, B, A, Z"), Error);

    // What holds nothing else is what it is read as.
    write({{"", {"R", "G", "B", "A"}}});
    CHECK(read(2) == Values{0, 1});
    CHECK(read(1) == Values{0});
    write({{"", {"Flow.X", "Flow.Y", "Flow.Z"}}});
    CHECK(read(2) == Values{0, 1});

    // A picture's colours are not its depth, nor one of two depths; its normals are not its motion.
    write({{"", {"R", "G", "B", "near.Z", "far.Z"}}});
    CHECK_THROWS_WITH_AS(read(1), Contains("which of its channels are depth?"), Error);
    write({{"", {"R", "G", "B", "A", "forward.u", "forward.v"}}});
    CHECK(read(2) == Values{4, 5});
    CHECK_THROWS_WITH_AS(read(1), Contains("which of its channels are depth?"), Error);
    write({{"",
            {"View.Combined.R", "View.Combined.G", "View.Combined.B", "View.Combined.A", "View.Depth.Z",
             "View.Normal.X", "View.Normal.Y", "View.Normal.Z"}}});
    CHECK(read(3) == Values{0, 1, 2});
    CHECK(read(1) == Values{4});
    CHECK_THROWS_WITH_AS(read(2), Contains("which of its channels are motion?"), Error);

    // Blender's, of which the first in the alphabet is no colour.
    write({{"",
            {"View.Albedo.R", "View.Albedo.G", "View.Albedo.B", "View.Combined.R", "View.Combined.G", "View.Combined.B",
             "View.Combined.A", "View.Depth.Z", "View.Normal.X", "View.Normal.Y", "View.Normal.Z", "View.Vector.X",
             "View.Vector.Y", "View.Vector.Z", "View.Vector.W"}}});
    CHECK(read(3) == Values{3, 4, 5});
    CHECK(read(2) == Values{11, 12});
    CHECK(read(1) == Values{7});

    // Nuke's, and an engine's.
    write({{"", {"R", "G", "B", "A", "depth.Z", "forward.u", "forward.v"}}});
    CHECK(read(3) == Values{0, 1, 2});
    CHECK(read(2) == Values{5, 6});
    CHECK(read(1) == Values{4});
    write({{"", {"R", "G", "B", "A", "Velocity.R", "Velocity.G", "SceneDepth.R"}}});
    CHECK(read(2) == Values{4, 5});
    CHECK(read(1) == Values{6});

    write({{"normal", {"X", "Y", "Z"}}, {"rgba", {"R", "G", "B", "A"}}, {"velocity", {"X", "Y"}}, {"depth", {"Z"}}});
    CHECK(read(3) == Values{3, 4, 5});
    CHECK(read(2) == Values{7, 8});
    CHECK(read(1) == Values{9});

    write({{"", {"diffuse.R", "diffuse.G", "diffuse.B", "glossy.R", "glossy.G", "glossy.B"}}});
    CHECK_THROWS_WITH_AS(read(3), Contains("which of its channels are colour? There are diffuse.R, diffuse.G"), Error);
    CHECK_THROWS_WITH_AS(read_image_header(path, 3), Contains("which of its channels are colour?"), Error);

    // What is another thing by its name is not taken because there is nothing better.
    write({{"", {"albedo.R", "albedo.G", "albedo.B", "depth.Z"}}});
    CHECK_THROWS_WITH_AS(read(3), Contains("which of its channels are colour? There are albedo.R"), Error);
    CHECK(read(1) == Values{3});
    write({{"", {"rgba.red", "rgba.green", "rgba.blue", "normal.R", "normal.G", "normal.B"}}});
    CHECK(read(3) == Values{0, 1, 2});
    write({{"", {"N.X", "N.Y", "N.Z", "R", "G", "B"}}});
    CHECK_THROWS_WITH_AS(read(1), Contains("which of its channels are depth?"), Error);
    CHECK(read(3) == Values{3, 4, 5});
    write({{"", {"albedo.R", "albedo.G", "albedo.B", "albedo.A"}}});  // there is nothing else
    CHECK(read(3) == Values{0, 1, 2});

    // Colour and its alpha.
    write({{"", {"R", "G", "B", "A", "Z"}}});
    CHECK(read(4) == Values{0, 1, 2, 3});
    CHECK(read_image_header(path, 4).channels == 4);
    write({{"", {"R", "G", "B", "Z"}}});
    CHECK(read_image_header(path, 4).channels == 3);
    CHECK(read_image(path, 4).channels == 3);

    const auto named = [&](const ChannelNames& names) {
        const int count = static_cast<int>(names.names.size());
        const ImageHeader header = read_image_header(path, count, names);
        CHECK(header.channels == count);
        const Pixels pixels = read_image(path, count, names);
        REQUIRE(pixels.channels == count);
        return std::vector<float>(pixels.values.end() - count, pixels.values.end());
    };
    write({{"", {"a.R", "a.G", "a.B", "b.R", "b.G", "b.B", "b.A"}}});
    CHECK(named({"", {"b.R", "b.G", "b.B"}}) == Values{3, 4, 5});
    CHECK(named({"", {"b.B", "b.G", "a.R", "b.A"}}) == Values{5, 4, 0, 6});
    CHECK_THROWS_WITH_AS(named({"", {"c.R"}}), Contains("it has no channel c.R; there are a.R, a.G"), Error);
    write({{"normal", {"X", "Y", "Z"}}, {"flow", {"X", "Y"}}, {"distance", {"T", "Z"}}});
    CHECK_THROWS_WITH_AS(named({"", {"X", "Y"}}), Contains("more than one `part` has all"), Error);
    CHECK_THROWS_WITH_AS(named({"", {"X", "T"}}), Contains("no part has all"), Error);
    CHECK(named({"flow", {"Y", "X"}}) == Values{4, 3});
    CHECK(read_image(path, 2, {"flow", {}}).at(2, 1, 1) == 4);
    CHECK(read_image(path, 1, {"distance", {}}).at(2, 1, 0) == 6);
    CHECK_THROWS_WITH_AS(named({"velocity", {"X"}}), Contains("it has no part velocity"), Error);

    const std::filesystem::path png = folder / "picture.png";
    const Pixels picture = test_image({16, 9}, 3);
    write_image(png, picture, SampleType::u8);
    const Pixels reversed = read_image(png, 3, {"", {"B", "G", "R"}}), as_is = read_image(png);
    for (int c = 0; c < 3; ++c) CHECK(reversed.at(7, 5, c) == as_is.at(7, 5, 2 - c));
}

TEST_CASE("what a file gives back is what as_stored says, and its header tells the type") {
    const TemporaryFolder folder;
    const Pixels image = test_image({16, 9}, 3);
    for (const auto& [type, name] : {std::pair{SampleType::u8, "8.png"},
                                     {SampleType::u16, "16.png"},
                                     {SampleType::f16, "16.exr"},
                                     {SampleType::f32, "32.exr"}}) {
        CAPTURE(name);
        write_image(folder / name, image, type);
        CHECK(read_image_header(folder / name).type == type);
        const Pixels back = read_image(folder / name), expected = as_stored(image, type);
        float worst = 0;
        for (size_t i = 0; i < back.values.size(); ++i)
            worst = std::fmax(worst, std::fabs(back.values[i] - expected.values[i]));
        CHECK(worst < 1e-6f);  // a 65535th is 1.5e-5
    }
}

TEST_CASE("a picture that is stored turned or mirrored is read as it is shown") {
    const TemporaryFolder folder;
    const std::string path = folder / "turned.tif";
    const Size size{3, 2};
    std::vector<unsigned char> stored(3 * 6);
    for (size_t i = 0; i < stored.size(); ++i) stored[i] = static_cast<unsigned char>(i / 3);
    // By row 0 and column 0 as Exif names them; pixels are numbered as they are stored, 0 1 2 above 3 4 5.
    const std::pair<int, std::vector<int>> shown[] = {
        {1, {0, 1, 2, 3, 4, 5}}, {2, {2, 1, 0, 5, 4, 3}}, {3, {5, 4, 3, 2, 1, 0}}, {4, {3, 4, 5, 0, 1, 2}},
        {5, {0, 3, 1, 4, 2, 5}}, {6, {3, 0, 4, 1, 5, 2}}, {7, {5, 2, 4, 1, 3, 0}}, {8, {2, 5, 1, 4, 0, 3}}};
    for (const auto& [orientation, order] : shown) {
        CAPTURE(orientation);
        OIIO::ImageSpec spec(size.width, size.height, 3, OIIO::TypeDesc::UINT8);
        spec.attribute("Orientation", orientation);
        const auto output = OIIO::ImageOutput::create(path);
        REQUIRE(output->open(path, spec));
        REQUIRE(output->write_image(OIIO::TypeDesc::UINT8, stored.data()));
        output->close();
        const Size expected = orientation < 5 ? size : Size{size.height, size.width};
        CHECK(read_image_header(path).size == expected);
        const Pixels pixels = read_image(path);
        REQUIRE(pixels.size == expected);
        for (size_t i = 0; i < order.size(); ++i) CHECK(pixels.values[3 * i] * 255 == doctest::Approx(order[i]));
    }
}

TEST_CASE("values that are not finite") {
    const TemporaryFolder folder;
    constexpr float infinity = std::numeric_limits<float>::infinity(), nan = std::numeric_limits<float>::quiet_NaN();
    const Pixels image{{4, 1}, 1, {nan, infinity, -infinity, 0.5f}};
    write_image(folder / "image.png", image, SampleType::u8);
    CHECK(read_image(folder / "image.png").values[0] == 0);
    CHECK(read_image(folder / "image.png").values[1] == 1);
    CHECK(read_image(folder / "image.png").values[2] == 0);

    write_image(folder / "image.exr", image, SampleType::f32);
    const Pixels back = read_image(folder / "image.exr");
    CHECK(std::isnan(back.values[0]));
    CHECK(back.values[1] == infinity);
    CHECK(back.values[2] == -infinity);
}

TEST_CASE("images that cannot be read are named, with the reason") {
    const TemporaryFolder folder;
    CHECK_THROWS_WITH_AS(read_image(folder / "none.png"), Contains("none.png: No such file"), Error);
    CHECK_THROWS_WITH_AS(read_image(folder.path()), Contains("not a file"), Error);
    std::ofstream(folder / "text.png") << "this is no picture";
    CHECK_THROWS_WITH_AS(read_image_header(folder / "text.png"), Contains("text.png"), Error);
    std::ofstream(folder / "empty.exr");
    CHECK_THROWS_WITH_AS(read_image_header(folder / "empty.exr"), Contains("empty.exr"), Error);

    const Pixels image = test_image({200, 100}, 3);
    write_image(folder / "whole.png", image, SampleType::u8);
    write_image(folder / "whole.exr", image, SampleType::f32);
    for (const size_t keep : {1, 10, 50, 99}) {
        for (const char* extension : {".png", ".exr"}) {
            const auto file = folder / ("cut" + std::string(extension));
            cut(folder / ("whole" + std::string(extension)), file, keep);
            CAPTURE(keep);
            CHECK_THROWS_WITH_AS(read_image(file), Contains(file.filename().c_str()), Error);
        }
    }
}

TEST_CASE("what cannot be written is refused and leaves nothing behind") {
    const TemporaryFolder folder;
    const Pixels image = test_image({64, 64}, 3);
    CHECK_THROWS_WITH_AS(write_image(folder / "none/0000.png", image, SampleType::u8),
                         Contains("none/0000.png: No such file or directory"), Error);
    std::ofstream(folder / "file") << "in the way";
    CHECK_THROWS_WITH_AS(write_image(folder / "file/0000.png", image, SampleType::u8), Contains("Not a directory"),
                         Error);
    std::filesystem::create_directories(folder / "0000.png" / "in the way");
    CHECK_THROWS_WITH_AS(write_image(folder / "0000.png", image, SampleType::u8), Contains("0000.png: Is a directory"),
                         Error);
    CHECK_THROWS_WITH_AS(write_image(folder / "0001.unknown", image, SampleType::u8), Contains("0001.unknown"), Error);
    CHECK_THROWS_WITH_AS(write_image(folder / "0001.exr", image, SampleType::u8), Contains("cannot hold uint8"), Error);
    CHECK_THROWS_WITH_AS(write_image(folder / "0001.png", Pixels{{2, 2}, 3, {1, 2, 3}}, SampleType::u8),
                         Contains("3 values are no 2x2 image with 3 channels"), Error);
    CHECK_THROWS_AS(write_image(folder / "0001.png", Pixels{}, SampleType::u8), Error);
    CHECK(files_in(folder.path()) == 2);
}

TEST_CASE("a disk that fills up costs no file that was there") {
    const TemporaryFolder folder;
    const Pixels image = test_image({64, 64}, 3), other = test_image({8, 8}, 3);
    write_image(folder / "old.exr", other, SampleType::f32);
    {
        const FullDisk full(1000);
        CHECK_THROWS_WITH_AS(write_image(folder / "new.exr", image, SampleType::f32),
                             Contains("new.exr: File too large"), Error);
        CHECK_THROWS_AS(write_image(folder / "old.exr", image, SampleType::f32), Error);
    }
    CHECK(files_in(folder.path()) == 1);
    CHECK(read_image(folder / "old.exr").values == other.values);
}
