#include "io/image_folder.h"

#include <doctest/doctest.h>

#include <fstream>
#include <vector>

#include "clarus/error.h"
#include "io/frames.h"
#include "noise_sequence.h"
#include "temporary_folder.h"

using namespace clarus;
using namespace clarus::io;
using clarus::test::noise;
using doctest::Contains;

namespace {

constexpr Size size{6, 4};

void write(const std::filesystem::path& path, SampleType type = SampleType::u8) {
    write_image(path, noise(size, 3, 0, 1, 1), type);
}

std::vector<std::string> names_of(const Sequence& sequence) {
    std::vector<std::string> names;
    for (const FrameFiles& frame : sequence.frames) names.push_back(frame.name);
    return names;
}

}  // namespace

TEST_CASE("a folder of images is a sequence of colours, in the order that people count in") {
    const TemporaryFolder folder;
    for (const char* name : {"shot 10.png", "shot 9.png", "shot 9b.png", "shot 011.png", "Title.PNG", "shot 1.png"})
        write(folder / name);
    std::ofstream(folder / "notes.txt") << "no image";
    const Sequence sequence = read_sequence(folder.path(), Layout::guess, 3);
    CHECK(names_of(sequence) ==
          std::vector<std::string>{"Title", "shot 1", "shot 9", "shot 9b", "shot 10", "shot 011"});
    CHECK_FALSE(sequence.is_described);
    CHECK(sequence.render_size == size);
    CHECK(sequence.scale == 3);
    CHECK(sequence.color_space == ColorSpace::srgb);
    CHECK(sequence.frames[0].reset);
    CHECK_FALSE(sequence.frames[1].reset);
    CHECK(sequence.frames[1].jitter == Vec2{});
    CHECK(sequence.frames[1].color == folder / "shot 1.png");
    CHECK_NOTHROW(check_sequence(sequence, false, false));
    CHECK(read_sequence(folder.path(), Layout::images).scale == 2);
}

TEST_CASE("one image is a sequence, too") {
    const TemporaryFolder folder;
    write(folder / "photo.png");
    write(folder / "other.png");
    write(folder / "light.exr", SampleType::f32);
    const Sequence sequence = read_sequence(folder / "photo.png");
    CHECK(names_of(sequence) == std::vector<std::string>{"photo"});
    CHECK(sequence.folder == folder.path());
    CHECK(read_sequence(folder / "light.exr").color_space == ColorSpace::linear);
}

TEST_CASE("images alone are refused where more is needed, with what is missing") {
    const TemporaryFolder folder;
    write(folder / "0.png");
    write(folder / "1.png");
    const Sequence sequence = read_sequence(folder.path());
    const std::string place = folder.path().string();
    CHECK_THROWS_WITH_AS(check_sequence(sequence, true, true),
                         Contains((place + ": images alone lack depth, motion and jitter").c_str()), Error);
    CHECK_THROWS_WITH_AS(check_sequence(sequence, true, false), Contains("images alone lack depth and jitter"), Error);
    CHECK_THROWS_WITH_AS(check_sequence(sequence, false, true), Contains("images alone lack motion and jitter"), Error);
    CHECK_THROWS_WITH_AS(check_sequence(read_sequence(folder / "1.png"), true, true), Contains("1.png: images"), Error);
}

TEST_CASE("a link inside a folder of images is followed, one that leads out is not") {
    const TemporaryFolder outer;
    const std::filesystem::path folder = outer / "images";
    std::filesystem::create_directory(folder);
    write(folder / "0.png");
    write(outer / "secret.png");
    std::filesystem::create_symlink("0.png", folder / "1.png");
    CHECK(read_sequence(folder).frames.size() == 2);
    std::filesystem::create_symlink("../secret.png", folder / "2.png");
    CHECK_THROWS_WITH_AS(read_sequence(folder), Contains("2.png: a link leads it out of the sequence's folder"), Error);
}

TEST_CASE("images that make no sequence") {
    const TemporaryFolder folder;
    CHECK_THROWS_WITH_AS(read_sequence(folder / "none.png"), Contains("none.png: no such file"), Error);
    CHECK_THROWS_WITH_AS(read_sequence(folder.path()), Contains("cannot tell the layout"), Error);
    CHECK_THROWS_WITH_AS(read_sequence(folder.path(), Layout::images), Contains("there is no image in"), Error);
    write(folder / "0.png");
    write(folder / "1.exr", SampleType::f32);
    CHECK_THROWS_WITH_AS(read_sequence(folder.path()), Contains("1.exr one holds linear radiance"), Error);
    std::filesystem::remove(folder / "1.exr");
    write(folder / "0.tif");
    CHECK_THROWS_WITH_AS(read_sequence(folder.path()), Contains("are one frame twice"), Error);
    std::filesystem::remove(folder / "0.tif");
    write_image(folder / "1.png", noise({5, 4}, 3, 0, 1, 1), SampleType::u8);
    CHECK_THROWS_WITH_AS(check_sequence(read_sequence(folder.path()), false, false), Contains("1.png has 5x4 pixels"),
                         Error);
    std::ofstream(folder / "0.png") << "not an image";
    CHECK_THROWS_WITH_AS(read_sequence(folder.path()), Contains("0.png"), Error);
}
