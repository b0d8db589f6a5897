#include <sys/socket.h>
#include <sys/stat.h>

#include <cstring>
#include <fstream>
#include <limits>
#include <random>
#include <thread>
#include <vector>

#include "share/endpoint.h"
#include "share/layout.h"
#include "share_harness.h"

using namespace clarus::test;

namespace {

bool says(const char* part) { return std::string(clarus_share_last_error()).find(part) != std::string::npos; }

clarus_share_status try_open(const clarus_share_description& description, const char* name = "game") {
    clarus_share_stream* stream = nullptr;
    const clarus_share_status status = clarus_share_open(name, &description, &stream);
    CHECK((stream != nullptr) == (status == CLARUS_SHARE_OK));
    clarus_share_close(stream);
    return status;
}

/// Takes and releases the frame that is there.
clarus_share_frame taken(clarus_share_reader* reader) {
    clarus_share_frame frame{};
    REQUIRE(clarus_share_reader_wait(reader, 0, &frame) == CLARUS_SHARE_OK);
    REQUIRE(clarus_share_reader_release(reader) == CLARUS_SHARE_OK);
    return frame;
}

std::vector<unsigned char> random_bytes(size_t count, std::mt19937& random) {
    std::vector<unsigned char> bytes(count);
    for (unsigned char& byte : bytes) byte = static_cast<unsigned char>(random());
    return bytes;
}

/// The image's bytes without what is between rows.
std::vector<unsigned char> bytes_of(const clarus_share_image& image) {
    const size_t tight = share_tight_pitch(image.format, image.width);
    std::vector<unsigned char> bytes;
    for (int y = 0; y < image.height; ++y) {
        const auto* row = static_cast<const unsigned char*>(image.pixels) + static_cast<size_t>(y) * image.row_pitch;
        bytes.insert(bytes.end(), row, row + tight);
    }
    return bytes;
}

}  // namespace

TEST_CASE("every resource has a name") {
    CHECK(clarus_share_kind_name(CLARUS_SHARE_COLOR) == std::string("color"));
    CHECK(clarus_share_kind_name(CLARUS_SHARE_DISTORTION) == std::string("distortion"));
    CHECK(clarus_share_kind_name(CLARUS_SHARE_KINDS) == nullptr);
    CHECK(clarus_share_kind_name(static_cast<clarus_share_kind>(-1)) == nullptr);
}

TEST_CASE("every resource comes across in every format and pitch") {
    const RuntimeFolder folder;
    std::mt19937 random(1);
    for (const clarus_element_type type :
         {CLARUS_U8, CLARUS_F16, CLARUS_F32, CLARUS_U16, CLARUS_RGB10A2, CLARUS_R11G11B10F, CLARUS_D24})
        for (const int channels : {1, 2, 3, 4})
            for (const size_t gap : {0, 7}) {
                CAPTURE(type);
                CAPTURE(channels);
                clarus_share_description description = plain_description(13, 7);
                description.user_bytes = 5000;
                for (int kind = CLARUS_SHARE_COLOR; kind < CLARUS_SHARE_KINDS; ++kind) {
                    clarus_share_resource resource{{type, channels}, 13, 7, 0};
                    if (kind >= CLARUS_SHARE_HUDLESS_COLOR) resource.width = 26, resource.height = 14;
                    resource.row_pitch = gap ? share_tight_pitch(resource.format, resource.width) + gap * 4 : 0;
                    clarus_share_description alone = plain_description(13, 7);
                    alone.resources[kind] = resource;
                    if (try_open(alone) == CLARUS_SHARE_OK) description.resources[kind] = resource;
                }
                const SharedStream stream = open_stream("game", description);
                const SharedReader reader = open_reader("game");
                REQUIRE(connect(reader.get(), stream.get()).status == CLARUS_SHARE_OK);
                for (uint64_t number = 0; number < 5; ++number) {
                    clarus_share_frame frame;
                    REQUIRE(clarus_share_begin(stream.get(), 0, &frame) == CLARUS_SHARE_OK);
                    std::vector<std::vector<unsigned char>> sent(CLARUS_SHARE_KINDS);
                    for (int kind = 0; kind < CLARUS_SHARE_KINDS; ++kind) {
                        const clarus_share_image& image = frame.images[kind];
                        if (!image.pixels) continue;
                        sent[kind] = random_bytes(share_tight_pitch(image.format, image.width) * image.height, random);
                        const auto which = static_cast<clarus_share_kind>(kind);
                        REQUIRE(clarus_share_copy(&frame, which, sent[kind].data(), 0) == CLARUS_SHARE_OK);
                    }
                    const std::vector<unsigned char> user = random_bytes(4999, random);
                    std::memcpy(frame.user, user.data(), user.size());
                    frame.user_bytes = user.size();
                    frame.jitter_x = 0.25f, frame.jitter_y = -0.5f;
                    frame.exposure = 3, frame.fov_y = 1, frame.frame_seconds = 0.02f;
                    frame.near_plane = 0.1f, frame.far_plane = std::numeric_limits<float>::infinity();
                    frame.motion_scale_x = -13;
                    frame.has_matrices = 1;
                    frame.view[3] = 5, frame.projection[11] = -1;
                    REQUIRE(clarus_share_end(stream.get(), &frame) == CLARUS_SHARE_OK);

                    clarus_share_frame got;
                    REQUIRE(clarus_share_reader_wait(reader.get(), 0, &got) == CLARUS_SHARE_OK);
                    CHECK(got.number == number);
                    CHECK(got.slot == frame.slot);
                    CHECK(got.jitter_x == 0.25f);
                    CHECK(got.jitter_y == -0.5f);
                    CHECK(got.exposure == 3);
                    CHECK(got.fov_y == 1);
                    CHECK(got.frame_seconds == 0.02f);
                    CHECK(got.near_plane == 0.1f);
                    CHECK(got.far_plane == std::numeric_limits<float>::infinity());
                    CHECK(got.motion_scale_x == -13);
                    CHECK(got.motion_scale_y == 1);
                    CHECK(got.has_matrices == 1);
                    CHECK(got.view[3] == 5);
                    CHECK(got.projection[11] == -1);
                    CHECK(got.reset == (number == 0));
                    REQUIRE(got.user_bytes == user.size());
                    CHECK(std::memcmp(got.user, user.data(), user.size()) == 0);
                    for (int kind = 0; kind < CLARUS_SHARE_KINDS; ++kind) {
                        CAPTURE(kind);
                        REQUIRE((got.images[kind].pixels != nullptr) == (frame.images[kind].pixels != nullptr));
                        if (got.images[kind].pixels) CHECK(bytes_of(got.images[kind]) == sent[kind]);
                    }
                    CHECK(clarus_share_reader_release(reader.get()) == CLARUS_SHARE_OK);
                }
            }
    CHECK(folder.is_empty());
}

TEST_CASE("copying takes a source's pitch, and a frame's own size") {
    const RuntimeFolder folder;
    clarus_share_description description = plain_description(8, 6);
    description.dynamic_resolution = 1;
    const SharedStream stream = open_stream("game", description);
    const SharedReader reader = open_reader("game");
    REQUIRE(connect(reader.get(), stream.get()).status == CLARUS_SHARE_OK);
    std::vector<float> depth(12 * 6);
    for (size_t i = 0; i < depth.size(); ++i) depth[i] = static_cast<float>(i);

    clarus_share_frame frame;
    REQUIRE(clarus_share_begin(stream.get(), 0, &frame) == CLARUS_SHARE_OK);
    REQUIRE(clarus_share_copy(&frame, CLARUS_SHARE_DEPTH, depth.data(), 12 * sizeof(float)) == CLARUS_SHARE_OK);
    CHECK(clarus_share_copy(&frame, CLARUS_SHARE_DEPTH, depth.data(), 7 * sizeof(float)) ==
          CLARUS_SHARE_INVALID_ARGUMENT);
    CHECK(clarus_share_copy(&frame, CLARUS_SHARE_UI, depth.data(), 0) == CLARUS_SHARE_INVALID_ARGUMENT);
    frame.width = 5;
    frame.height = 3;
    const std::vector<float> small(15, -1);
    REQUIRE(clarus_share_copy(&frame, CLARUS_SHARE_DEPTH, small.data(), 0) == CLARUS_SHARE_OK);
    REQUIRE(clarus_share_end(stream.get(), &frame) == CLARUS_SHARE_OK);
    frame.width = 9;
    CHECK(clarus_share_copy(&frame, CLARUS_SHARE_DEPTH, depth.data(), 0) == CLARUS_SHARE_INVALID_ARGUMENT);
    clarus_share_frame got;
    REQUIRE(clarus_share_reader_wait(reader.get(), 0, &got) == CLARUS_SHARE_OK);
    const clarus_share_image& image = got.images[CLARUS_SHARE_DEPTH];
    CHECK(image.width == 5);
    CHECK(image.height == 3);
    CHECK(image.row_pitch == 8 * sizeof(float));
    const auto* pixels = static_cast<const float*>(image.pixels);
    CHECK(pixels[2 * 8 + 4] == -1);
    CHECK(pixels[2 * 8 + 5] == 2 * 12 + 5);
    CHECK(pixels[3 * 8 + 4] == 3 * 12 + 4);
}

TEST_CASE("under every-frame the renderer waits for a slot, in order, and nothing is lost") {
    const RuntimeFolder folder;
    for (const int slots : {2, 3, 8}) {
        clarus_share_description description = plain_description(4, 4);
        description.slots = slots;
        const SharedStream stream = open_stream("game", description);
        const SharedReader reader = open_reader("game");
        for (int i = 0; i < slots; ++i) share(stream.get(), static_cast<uint64_t>(i));  // before anybody is there
        clarus_share_frame frame;
        CHECK(clarus_share_begin(stream.get(), 0, &frame) == CLARUS_SHARE_TIMED_OUT);
        REQUIRE(connect(reader.get(), stream.get()).status == CLARUS_SHARE_OK);
        CHECK(clarus_share_begin(stream.get(), 10, &frame) == CLARUS_SHARE_TIMED_OUT);
        CHECK(says("busy"));

        for (int i = 0; i < slots; ++i) {  // all slots are held at once
            REQUIRE(clarus_share_reader_wait(reader.get(), 0, &frame) == CLARUS_SHARE_OK);
            CHECK(frame.number == static_cast<uint64_t>(i));
        }
        CHECK(clarus_share_reader_wait(reader.get(), 0, &frame) == CLARUS_SHARE_INVALID_ARGUMENT);
        CHECK(clarus_share_begin(stream.get(), 0, &frame) == CLARUS_SHARE_TIMED_OUT);
        CHECK(clarus_share_reader_release(reader.get()) == CLARUS_SHARE_OK);
        share(stream.get(), static_cast<uint64_t>(slots));
        CHECK(clarus_share_drain(stream.get(), 1) == CLARUS_SHARE_TIMED_OUT);
        for (int i = 1; i < slots; ++i) CHECK(clarus_share_reader_release(reader.get()) == CLARUS_SHARE_OK);
        CHECK(taken(reader.get()).number == static_cast<uint64_t>(slots));
        CHECK(clarus_share_drain(stream.get(), 0) == CLARUS_SHARE_OK);
        CHECK(clarus_share_reader_release(reader.get()) == CLARUS_SHARE_INVALID_ARGUMENT);
        CHECK(clarus_share_stream_state(stream.get()).released == static_cast<uint64_t>(slots) + 1);
    }
}

TEST_CASE("under newest-frame the renderer never waits, and what was skipped resets") {
    const RuntimeFolder folder;
    clarus_share_description description = plain_description(4, 4);
    description.policy = CLARUS_SHARE_NEWEST_FRAME;
    const SharedStream stream = open_stream("game", description);
    const SharedReader reader = open_reader("game");
    for (uint64_t i = 0; i < 10; ++i) share(stream.get(), i);
    REQUIRE(connect(reader.get(), stream.get()).status == CLARUS_SHARE_OK);

    clarus_share_frame held;
    REQUIRE(clarus_share_reader_wait(reader.get(), 0, &held) == CLARUS_SHARE_OK);
    CHECK(held.number == 9);
    CHECK(held.reset == 1);
    for (uint64_t i = 10; i < 30; ++i) {  // the one that is held is not written
        clarus_share_frame frame;
        REQUIRE(clarus_share_begin(stream.get(), 0, &frame) == CLARUS_SHARE_OK);
        CHECK(frame.slot != held.slot);
        REQUIRE(clarus_share_end(stream.get(), &frame) == CLARUS_SHARE_OK);
    }
    clarus_share_frame frame;
    CHECK(clarus_share_reader_wait(reader.get(), 0, &frame) == CLARUS_SHARE_INVALID_ARGUMENT);
    CHECK(clarus_share_reader_release(reader.get()) == CLARUS_SHARE_OK);
    frame = taken(reader.get());
    CHECK(frame.number == 29);
    CHECK(frame.reset == 1);
    CHECK(clarus_share_reader_state(reader.get()).skipped == 19);
    CHECK(clarus_share_drain(stream.get(), 0) == CLARUS_SHARE_OK);
    share(stream.get(), 30);
    CHECK(taken(reader.get()).reset == 0);
    CHECK(clarus_share_reader_wait(reader.get(), 0, &frame) == CLARUS_SHARE_TIMED_OUT);
}

TEST_CASE("a gap in the renderer's own numbers resets") {
    const RuntimeFolder folder;
    const SharedStream stream = open_stream("game", plain_description(4, 4));
    const SharedReader reader = open_reader("game");
    REQUIRE(connect(reader.get(), stream.get()).status == CLARUS_SHARE_OK);
    std::vector<int> resets;
    for (const uint64_t number : {7, 8, 9, 11, 12, 3, 4}) {
        share(stream.get(), number);
        resets.push_back(taken(reader.get()).reset);
    }
    CHECK(resets == std::vector{1, 0, 0, 1, 0, 1, 0});
}

TEST_CASE("waits end in time and when they are cancelled") {
    const RuntimeFolder folder;
    const SharedReader reader = open_reader("game");
    const auto start = std::chrono::steady_clock::now();
    CHECK(clarus_share_reader_connect(reader.get(), 0) == CLARUS_SHARE_NO_STREAM);
    CHECK(clarus_share_reader_connect(reader.get(), 50) == CLARUS_SHARE_NO_STREAM);
    CHECK(says("game.frames"));
    CHECK(std::chrono::steady_clock::now() - start >= std::chrono::milliseconds(50));

    const SharedStream stream = open_stream("game", plain_description(4, 4));
    CHECK(clarus_share_reader_connect(reader.get(), 50) == CLARUS_SHARE_TIMED_OUT);  // nobody asks begin
    REQUIRE(connect(reader.get(), stream.get()).status == CLARUS_SHARE_OK);
    clarus_share_frame frame;
    CHECK(clarus_share_reader_wait(reader.get(), 20, &frame) == CLARUS_SHARE_TIMED_OUT);

    std::thread cancels([&] {
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
        clarus_share_reader_cancel(reader.get());
    });
    CHECK(clarus_share_reader_wait(reader.get(), CLARUS_SHARE_NO_LIMIT, &frame) == CLARUS_SHARE_CANCELLED);
    cancels.join();
    CHECK(clarus_share_reader_wait(reader.get(), 0, &frame) == CLARUS_SHARE_CANCELLED);
    CHECK(clarus_share_reader_connect(reader.get(), CLARUS_SHARE_NO_LIMIT) == CLARUS_SHARE_CANCELLED);

    for (uint64_t i = 0; i < 3; ++i) share(stream.get(), i);
    std::thread cancels_too([&] {
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
        clarus_share_cancel(stream.get());
    });
    CHECK(clarus_share_begin(stream.get(), CLARUS_SHARE_NO_LIMIT, &frame) == CLARUS_SHARE_CANCELLED);
    cancels_too.join();
    CHECK(clarus_share_drain(stream.get(), CLARUS_SHARE_NO_LIMIT) == CLARUS_SHARE_CANCELLED);
}

TEST_CASE("a renderer that takes longer for a frame than a reader waits is connected to in the end") {
    const RuntimeFolder folder;
    clarus_share_description description = plain_description(4, 4);
    description.policy = CLARUS_SHARE_NEWEST_FRAME;  // begin never waits
    const SharedStream stream = open_stream("game", description);
    for (int i = 0; i < 5; ++i) {  // come and gone before the renderer looked
        const SharedReader impatient = open_reader("game");
        CHECK(clarus_share_reader_connect(impatient.get(), 1) == CLARUS_SHARE_TIMED_OUT);
    }
    const SharedReader reader = open_reader("game");
    CHECK(clarus_share_reader_connect(reader.get(), 1) == CLARUS_SHARE_TIMED_OUT);
    CHECK(clarus_share_reader_connect(reader.get(), 1) == CLARUS_SHARE_TIMED_OUT);
    share(stream.get(), 0);
    share(stream.get(), 1);
    CHECK(clarus_share_reader_connect(reader.get(), 1) == CLARUS_SHARE_OK);
    CHECK(taken(reader.get()).number == 1);
}

TEST_CASE("frames of a renderer that closed are still taken, then the stream has ended") {
    const RuntimeFolder folder;
    for (const clarus_share_policy policy : {CLARUS_SHARE_EVERY_FRAME, CLARUS_SHARE_NEWEST_FRAME}) {
        clarus_share_description description = plain_description(4, 4);
        description.policy = policy;
        SharedStream stream = open_stream("game", description);
        const SharedReader reader = open_reader("game");
        REQUIRE(connect(reader.get(), stream.get()).status == CLARUS_SHARE_OK);
        for (uint64_t i = 0; i < 3; ++i) share(stream.get(), i);
        stream.reset();
        CHECK(folder.is_empty());
        if (policy == CLARUS_SHARE_EVERY_FRAME)
            for (uint64_t i = 0; i < 2; ++i) CHECK(taken(reader.get()).number == i);
        CHECK(taken(reader.get()).number == 2);
        clarus_share_frame frame;
        CHECK(clarus_share_reader_wait(reader.get(), 1000, &frame) == CLARUS_SHARE_ENDED);
        CHECK(clarus_share_reader_wait(reader.get(), 1000, &frame) == CLARUS_SHARE_ENDED);

        const SharedStream again = open_stream("game", plain_description(6, 2));  // another, of the same name
        share(again.get(), 100);
        REQUIRE(connect(reader.get(), again.get()).status == CLARUS_SHARE_OK);
        CHECK(clarus_share_reader_description(reader.get())->resources[CLARUS_SHARE_COLOR].width == 6);
        frame = taken(reader.get());
        CHECK(frame.number == 100);
        CHECK(frame.reset == 1);
    }
}

TEST_CASE("what a reader that left had not released, the next one gets") {
    const RuntimeFolder folder;
    const SharedStream stream = open_stream("game", plain_description(4, 4));
    SharedReader first = open_reader("game");
    REQUIRE(connect(first.get(), stream.get()).status == CLARUS_SHARE_OK);
    for (uint64_t i = 0; i < 3; ++i) share(stream.get(), i);
    CHECK(taken(first.get()).number == 0);
    clarus_share_frame frame;
    CHECK(clarus_share_reader_wait(first.get(), 0, &frame) == CLARUS_SHARE_OK);  // 1, not released
    first.reset();
    const SharedReader second = open_reader("game");
    REQUIRE(connect(second.get(), stream.get()).status == CLARUS_SHARE_OK);
    frame = taken(second.get());
    CHECK(frame.number == 1);
    CHECK(frame.reset == 1);
    CHECK(taken(second.get()).number == 2);
}

TEST_CASE("a stream has one reader, and tells a second one") {
    const RuntimeFolder folder;
    const SharedStream stream = open_stream("game", plain_description(4, 4));
    const SharedReader first = open_reader("game"), second = open_reader("game");
    REQUIRE(connect(first.get(), stream.get()).status == CLARUS_SHARE_OK);
    const Told told = connect(second.get(), stream.get());
    CHECK(told.status == CLARUS_SHARE_REFUSED);
    CHECK(told.error.find("has an upscaler already") != std::string::npos);
    share(stream.get(), 0);
    CHECK(taken(first.get()).number == 0);
}

TEST_CASE("a reader that refuses says why") {
    const RuntimeFolder folder;
    const SharedStream stream = open_stream("game", plain_description(4, 4));
    const SharedReader reader = open_reader("game");
    REQUIRE(connect(reader.get(), stream.get()).status == CLARUS_SHARE_OK);
    clarus_share_reader_refuse(reader.get(), "no motion\nfor the model");
    for (uint64_t i = 0; i < 3; ++i) share(stream.get(), i);
    CHECK(std::string(clarus_share_stream_state(stream.get()).message) == "no motion?for the model");
    clarus_share_frame frame;
    CHECK(clarus_share_begin(stream.get(), 0, &frame) == CLARUS_SHARE_TIMED_OUT);
    CHECK(says("no upscaler; the last one said: no motion?for the model"));
}

TEST_CASE("a name in use is refused, a socket that a crash left is replaced") {
    const RuntimeFolder folder;
    {
        const SharedStream stream = open_stream("game", plain_description(4, 4));
        struct stat status {};
        REQUIRE(stat((folder / "game.frames").c_str(), &status) == 0);
        CHECK((status.st_mode & 0777) == 0600);
        CHECK(try_open(plain_description(4, 4)) == CLARUS_SHARE_NAME_IN_USE);
        CHECK(says("in use by another process"));
        const SharedReader reader = open_reader("game");  // the probe of the other left no trace
        REQUIRE(connect(reader.get(), stream.get()).status == CLARUS_SHARE_OK);
    }
    share_endpoint leftover;
    REQUIRE(share_listen("game", SHARE_FRAMES_SUFFIX, &leftover) == CLARUS_SHARE_OK);
    share_close(&leftover.socket);
    CHECK(exists(folder / "game.frames"));
    CHECK(try_open(plain_description(4, 4)) == CLARUS_SHARE_OK);
    CHECK(folder.is_empty());

    std::ofstream(folder / "game.frames") << "not a socket";
    CHECK(try_open(plain_description(4, 4)) == CLARUS_SHARE_NAME_IN_USE);
    CHECK(says("is in the way"));
    CHECK(exists(folder / "game.frames"));
}

TEST_CASE("a stream that closes leaves the socket of another that took its place") {
    const RuntimeFolder folder;
    SharedStream stream = open_stream("game", plain_description(4, 4));
    std::filesystem::remove(folder / "game.frames");
    const SharedStream other = open_stream("game", plain_description(4, 4));
    stream.reset();
    CHECK(exists(folder / "game.frames"));
}

TEST_CASE("the runtime folder must be the user's alone") {
    const RuntimeFolder folder;
    REQUIRE(try_open(plain_description(4, 4)) == CLARUS_SHARE_OK);
    std::filesystem::permissions(folder / "", std::filesystem::perms::all);
    CHECK(try_open(plain_description(4, 4)) == CLARUS_SHARE_SYSTEM);
    CHECK(says("closed to others"));
    std::filesystem::permissions(folder / "", std::filesystem::perms::owner_all);
    setenv("XDG_RUNTIME_DIR", (folder / "missing").c_str(), 1);
    CHECK(try_open(plain_description(4, 4)) == CLARUS_SHARE_SYSTEM);
    CHECK(says("XDG_RUNTIME_DIR must name a folder"));
    setenv("XDG_RUNTIME_DIR", ("/" + std::string(200, 'x')).c_str(), 1);
    CHECK(try_open(plain_description(4, 4)) == CLARUS_SHARE_SYSTEM);
    CHECK(says("too long"));
}

TEST_CASE("names that no file should have are refused") {
    const RuntimeFolder folder;
    for (const std::string& name : {std::string(), std::string("."), std::string("../game"), std::string("a/b"),
                                    std::string("a b"), std::string(65, 'a'), std::string("g\xc3\xa4me")}) {
        CAPTURE(name);
        CHECK(try_open(plain_description(4, 4), name.c_str()) == CLARUS_SHARE_INVALID_ARGUMENT);
        CHECK(says("the stream name"));
        clarus_share_reader* reader = nullptr;
        CHECK(clarus_share_reader_open(name.c_str(), &reader) == CLARUS_SHARE_INVALID_ARGUMENT);
    }
}

TEST_CASE("a stream that cannot be is refused before memory is taken") {
    const RuntimeFolder folder;
    const auto refused = [](auto change, const char* words) {
        clarus_share_description description = plain_description(64, 32);
        change(description);
        CAPTURE(words);
        CHECK(try_open(description) == CLARUS_SHARE_INVALID_ARGUMENT);
        CHECK_MESSAGE(says(words), clarus_share_last_error());
    };
    refused([](auto& d) { d.slots = 1000; }, "1000 slots; from 2 to 8");
    refused([](auto& d) { d.slots = 1; }, "1 slots");
    refused([](auto& d) { d = plain_description(31623, 31623); }, "a slot holds at most 1024 MiB");
    refused([](auto& d) { d = plain_description(1 << 20, 1000); }, "each side is from 1 to 32768");
    refused([](auto& d) { d = plain_description(-4, 4); }, "color: -4x4");
    refused([](auto& d) { d.resources[CLARUS_SHARE_COLOR] = {}; }, "color: 0 channels");
    refused([](auto& d) { d.resources[CLARUS_SHARE_COLOR].format.channels = 5; }, "from 3 to 4");
    refused([](auto& d) { d.resources[CLARUS_SHARE_MOTION].format.type = CLARUS_U8; },
            "motion: u8; possible are f16 and f32");
    refused([](auto& d) { d.resources[CLARUS_SHARE_MOTION].format.type = CLARUS_RGB10A2; }, "motion: rgb10a2");
    refused([](auto& d) { d.resources[CLARUS_SHARE_COLOR].format.type = static_cast<clarus_element_type>(7); },
            "color: element type 7; they are from u8 (0) to d24 (6)");
    refused(
        [](auto& d) {
            d.resources[CLARUS_SHARE_COLOR].format = {CLARUS_RGB10A2, 3};
        },
        "color: 3 channels; rgb10a2 has 4");
    refused([](auto& d) { d.resources[CLARUS_SHARE_COLOR].format.type = CLARUS_D24; }, "d24 has 1");
    refused([](auto& d) { d.resources[CLARUS_SHARE_DEPTH].width = 63; }, "depth: 63x32 pixels where the colour has");
    refused([](auto& d) { d.resources[CLARUS_SHARE_DEPTH].row_pitch = 255; }, "row pitch 255");
    refused([](auto& d) { d.resources[CLARUS_SHARE_DEPTH].row_pitch = 258; }, "row pitch 258");
    refused([](auto& d) { d.policy = static_cast<clarus_share_policy>(2); }, "policy 2");
    refused([](auto& d) { d.linear_color = 2; }, "linear_color is 2");
    refused([](auto& d) { d.scale = 0.5f; }, "scale 0.5");
    refused([](auto& d) { d.output_width = 100; }, "output size 100x0");
    refused([](auto& d) { d.user_bytes = (1 << 20) + 1; }, "user data a frame");
    refused([](auto& d) { d.motion_scale_x = std::numeric_limits<float>::quiet_NaN(); }, "not finite");
    CHECK(folder.is_empty());
}

TEST_CASE("a frame that cannot be stays begun") {
    const RuntimeFolder folder;
    clarus_share_description description = plain_description(8, 8);
    description.depth_projective = 1;
    const SharedStream stream = open_stream("game", description);
    clarus_share_frame frame;
    REQUIRE(clarus_share_begin(stream.get(), 0, &frame) == CLARUS_SHARE_OK);
    CHECK(clarus_share_end(stream.get(), &frame) == CLARUS_SHARE_INVALID_ARGUMENT);
    CHECK(says("0 < near < far"));
    frame.near_plane = 0.1f;
    frame.far_plane = 10;
    const auto refused = [&](auto change, const char* words) {
        clarus_share_frame other = frame;
        change(other);
        CAPTURE(words);
        CHECK(clarus_share_end(stream.get(), &other) == CLARUS_SHARE_INVALID_ARGUMENT);
        CHECK_MESSAGE(says(words), clarus_share_last_error());
    };
    refused([](auto& f) { f.width = 7; }, "frame size 7x8; the stream's is 8x8, unless it has dynamic resolution");
    refused([](auto& f) { f.width = 9; }, "frame size 9x8");
    refused([](auto& f) { f.height = 0; }, "frame size 8x0");
    refused([](auto& f) { f.jitter_x = 1.5f; }, "jitter");
    refused([](auto& f) { f.exposure = 0; }, "exposure");
    refused([](auto& f) { f.far_plane = 0.05f; }, "far");
    refused([](auto& f) { f.fov_y = 7; }, "fov_y");
    refused([](auto& f) { f.frame_seconds = -1; }, "frame_seconds");
    refused([](auto& f) { f.motion_scale_y = std::numeric_limits<float>::infinity(); }, "motion_scale");
    refused([](auto& f) { f.reset = 2; }, "reset 2");
    refused([](auto& f) { f.has_matrices = 1, f.view[0] = std::numeric_limits<float>::quiet_NaN(); }, "matrix");
    refused([](auto& f) { f.user_bytes = 1; }, "1 bytes of user data");
    refused([](auto& f) { f.slot = 2; }, "without the frame of clarus_share_begin");
    CHECK(clarus_share_end(stream.get(), &frame) == CLARUS_SHARE_OK);
    CHECK(clarus_share_end(stream.get(), &frame) == CLARUS_SHARE_INVALID_ARGUMENT);
}
