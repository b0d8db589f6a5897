#include <algorithm>
#include <array>
#include <cstring>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "io/file.h"
#include "io/frames.h"
#include "io/image.h"
#include "io/sequence.h"
#include "run_clarus.h"
#include "share_programs.h"

// `clarus serve`, `play` and `control` as processes.

using namespace clarus;
using namespace clarus::test;
using namespace std::chrono_literals;
namespace fs = std::filesystem;
using nlohmann::json;

namespace {

constexpr Size render_size{24, 16};
const std::string network = CLARUS_GOLDEN_DIR "/enss_x2_table.model.safetensors";

Outcome control(const std::vector<std::string>& arguments) {
    std::vector<std::string> all{"control"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    return run_clarus(all);
}
/// Empty as long as nobody serves.
json state() {
    const Outcome outcome = control({"game", "--json"});
    return outcome.code == 0 ? json::parse(outcome.out) : json::object();
}

}  // namespace

TEST_CASE("what is served is the same bytes as what is upscaled from files") {
    const Workplace place(5);
    for (const std::string& model : {network, std::string("bilinear")}) {
        place.upscale(model, "upscaled");
        for (const bool serves_first : {true, false}) {
            fs::remove_all(place / "served");
            std::unique_ptr<Program> server, player;
            if (serves_first) server = place.serve(model, "served");
            player = place.play();
            if (!serves_first) server = place.serve(model, "served");
            CHECK(player->result() == 0);
            CHECK(server->result() == 0);
            CHECK(contains(player->out(), "5 frames shared, 5 upscaled"));
            CHECK(contains(server->out(), "5 frames, 0 skipped"));
            check_same_files(place, "upscaled", "served", 5);
            CHECK(place.runtime.is_empty());
        }
    }
}

TEST_CASE("masks of files and of a stream act alike, where a frame has one") {
    const Workplace place(4);
    place.upscale(network, "without");
    json sequence = place.description();
    for (const auto& [key, frame] : {std::pair{"reactive", 1}, std::pair{"transparency", 2}}) {
        const std::string file = std::string(key) + ".png";
        io::Pixels mask{render_size, 1, std::vector<float>(24 * 16)};
        std::fill_n(mask.values.begin(), 24 * 8, 1.0f);
        io::write_image(place / "sequence" / file, mask, io::SampleType::u8);
        sequence["frames"][frame][key] = file;
    }
    place.describe(sequence);
    place.upscale(network, "upscaled");
    CHECK(place.bytes("upscaled/0000.png") == place.bytes("without/0000.png"));
    CHECK(place.bytes("upscaled/0001.png") != place.bytes("without/0001.png"));
    CHECK(place.bytes("upscaled/0002.png") != place.bytes("without/0002.png"));
    const auto server = place.serve(network, "served");
    CHECK(place.play()->result() == 0);
    CHECK(server->result() == 0);
    check_same_files(place, "upscaled", "served", 4);
}

TEST_CASE("a video of what is served is the same bytes as one of what is upscaled, and its size stays") {
    if (!CLARUS_VIDEO) {
        MESSAGE("built without videos: not tried");
        return;
    }
    const Workplace place(5);
    place.upscale(network, "upscaled.mp4", {"--crf", "10"});
    auto server = place.serve(network, "served.mp4", {"--crf", "10"});
    CHECK(place.play()->result() == 0);
    CHECK(server->result() == 0);
    CHECK(place.bytes("upscaled.mp4") == place.bytes("served.mp4"));

    server = place.serve("bilinear", "other.mkv");
    const auto player = place.play({"--loop", "--frame-rate", "30"});
    REQUIRE(comes_true([&] { return state()["frames"] > 2; }));
    const Outcome refused = control({"game", "output-size=40x40"});
    CHECK_MESSAGE(contains(refused.errors, "--output began with 48x32"), refused.errors);
    CHECK(control({"game", "model=nearest"}).code == 0);
    CHECK_FALSE(fs::exists(place / "other.mkv"));
    server->interrupt();
    CHECK(server->result() == 0);
    CHECK(fs::exists(place / "other.mkv"));
    player->interrupt();
    CHECK(player->result() == 0);
}

TEST_CASE("what several devices serve is the same bytes") {
    if (test_device().profile().compute_units < 2) {
        MESSAGE("a device of one compute unit: not tried");
        return;
    }
    const Workplace place(5);
    place.upscale(network, "upscaled");
    const std::string parts = test_selector() + "/1, " + test_selector() + "/1=dsp";
    Program server(CLARUS_TOOL, {"serve", "game", "--model", network, "--device", parts, "--place", "*conv*=dsp",
                                 "--fallback", "-o", place / "served"});
    CHECK(place.play()->result() == 0);
    CHECK(server.result() == 0);
    check_same_files(place, "upscaled", "served", 5);
}

TEST_CASE("what is served may be a stream again, from which another upscaler takes it") {
    const Workplace place(5);
    place.upscale(network, "upscaled");
    Program first(CLARUS_TOOL, {"serve", "game", "--model", network, "--device", test_selector(), "-o", "ring:big"});
    Program second(CLARUS_TOOL, {"serve", "big", "--model", "nearest", "--scale", "1", "--device", test_selector(),
                                 "-o", place / "served"});
    CHECK(place.play()->result() == 0);
    CHECK(first.result() == 0);
    CHECK(second.result() == 0);
    CHECK(contains(second.out(), "big: nearest at 48x32, to 48x32"));
    check_same_files(place, "upscaled", "served", 5);
    CHECK(place.runtime.is_empty());

    Program taken(CLARUS_TOOL,
                  {"serve", "game", "--model", "nearest", "--device", test_selector(), "-o", "ring:a name"});
    CHECK(taken.result() == 1);
    CHECK_MESSAGE(contains(taken.errors(), "\"a name\""), taken.errors());
}

TEST_CASE("an upscaler that dies is started again, but not for ever") {
    const Workplace place(5);
    const auto server = place.serve(network, "served", {"--restart", "--keep"});
    const auto player = place.play({"--loop", "--frame-rate", "60"});
    for (int before = 0, death = 0; death < 3; ++death) {
        REQUIRE(comes_true([&] { return state()["frames"] > 2 && state()["process"] != before; }));
        before = state()["process"];
        CHECK(before != server->id());
        kill(before, SIGKILL);
    }
    CHECK(server->result() == 1);
    CHECK(contains(server->errors(), "clarus serve game died of signal 9, Killed; it is started again"));
    CHECK(contains(server->errors(), "not started again"));

    const auto next = place.serve(network, "served", {"--restart"});
    REQUIRE(comes_true([&] { return state()["frames"] > 2; }));
    next->interrupt();
    CHECK(next->result() == 0);
    CHECK(contains(next->out(), "0 skipped"));
    player->interrupt();
    CHECK(player->result() == 0);
    CHECK(place.runtime.is_empty());

    Program video(CLARUS_TOOL, {"serve", "game", "--model", "bilinear", "--restart", "-o", place / "a.mp4"});
    CHECK(video.result() == 1);
    CHECK_MESSAGE(contains(video.errors(), "--restart: a video cannot be gone on with"), video.errors());
}

TEST_CASE("a stream is handed to python3, a part a frame, and what it says is told") {
    if (!CLARUS_VIDEO) {
        MESSAGE("built without videos: not tried");
        return;
    }
    const Workplace place(5);
    const auto serve = [&](const std::string& stand_in) {
        fs::create_directories(place / "bin");
        std::ofstream(place / "bin/python3") << "#!/bin/sh\n" << stand_in << "\n";
        fs::permissions(place / "bin/python3", fs::perms::owner_all);
        return std::make_unique<Program>(
            "/bin/sh",
            std::vector<std::string>{"-c", "PATH='" + (place / "bin").string() +
                                               "':$PATH exec '" CLARUS_TOOL "' serve game --model bilinear --device '" +
                                               test_selector() + "' --trace '" + (place / "trace.json").string() +
                                               "' --output moq:https://127.0.0.1:4443/live"});
    };
    auto server = serve("echo no relay");
    CHECK(server->result() == 1);
    CHECK(contains(server->errors(), "cannot publish moq:https://127.0.0.1:4443/live: no relay"));
    server = serve("exit 1");
    CHECK(server->result() == 1);
    CHECK(contains(server->errors(), "python3 ended"));

    server = serve("echo ready; echo \"$3\" >'" + (place / "url").string() + "'; exec cat >'" +
                   (place / "parts").string() + "'");
    CHECK(place.play({"--trace", place / "played.json"})->result() == 0);
    CHECK(server->result() == 0);
    CHECK(place.bytes("url") == "https://127.0.0.1:4443/live\n");
    const std::string parts = place.bytes("parts");
    std::vector<uint32_t> keys;
    for (size_t at = 0; at < parts.size();) {
        std::array<uint32_t, 2> header;  // length, key
        std::memcpy(header.data(), &parts[at], sizeof header);
        REQUIRE(at + sizeof header + header[0] <= parts.size());
        CHECK(parts.substr(at + sizeof header + 4, 4) == (at == 0 ? "ftyp" : "prft"));
        keys.push_back(header[1]);
        at += sizeof header + header[0];
    }
    CHECK(keys == std::vector<uint32_t>{0, 1, 0, 0, 0, 0});
    std::map<std::string, int> spans;
    for (const char* file : {"trace.json", "played.json"}) {
        const json trace = json::parse(place.bytes(file));
        for (const json& event : trace["traceEvents"]) ++spans[event["name"]];
        CHECK(trace["otherData"]["began"] > 1e15);  // microseconds since 1970
    }
    for (const char* span : {"render", "copy into the slot", "wait for device", "encode"}) CHECK(spans[span] == 5);

    server = serve("echo ready; exec head -c 3000 >/dev/null");
    const auto player = place.play({"--loop"});
    CHECK(server->result() == 1);
    CHECK(contains(server->errors(), "the stream moq:https://127.0.0.1:4443/live has ended"));
    player->interrupt();
    CHECK(player->result() == 0);
}

TEST_CASE("linear HDR, a resolution that changes, and a part of a sequence are served as they are upscaled") {
    const Workplace place(4);
    write_noise_sequence(place / "sequence", render_size, 4, ColorSpace::linear);
    json description = place.description();
    json& frame = description["frames"][2];
    frame["render_size"] = {18, 12};
    for (const auto& [key, channels] : {std::pair("color", 3), std::pair("depth", 1), std::pair("motion", 2)})
        io::write_image(place / "sequence" / frame[key].get<std::string>(), noise({18, 12}, channels, 0, 1, 1),
                        io::SampleType::f32);
    place.describe(description);
    place.upscale(network, "upscaled", {"--frames", "1:"});
    const auto server = place.serve(network, "served");
    CHECK(place.play({"--frames", "1:", "--slots", "2"})->result() == 0);
    CHECK(server->result() == 0);
    CHECK(place.files("served") == std::set<std::string>{"0001.exr", "0002.exr", "0003.exr"});
    check_same_files(place, "upscaled", "served", 3);
}

TEST_CASE("the model changes between two frames, and none is lost") {
    constexpr size_t frames = 6;
    const Workplace place(frames);
    place.upscale(network, "by network");
    place.upscale("nearest", "by nearest", {"--scale", "3"});
    const auto server = place.serve(network, "served");
    const auto player = place.play({"--loop", "--frame-rate", "20"});
    REQUIRE(comes_true([&] { return place.files("served").size() >= 8; }));
    CHECK(state()["model"] == "enss_x2_table.model");
    const Outcome changed = control({"game", "model=nearest", "output-size=72x48"});
    CHECK_MESSAGE(changed.code == 0, changed.errors);
    CHECK(contains(changed.out, "model nearest, scale 3: 24x16 to 72x48"));
    REQUIRE(comes_true([&] { return state()["changes"] == 1; }));
    const size_t when = place.files("served").size();
    REQUIRE(comes_true([&] { return place.files("served").size() >= when + 8; }));
    player->interrupt();
    CHECK(player->result() == 0);
    CHECK(server->result() == 0);

    size_t by_network = 0, by_nearest = 0;
    const size_t count = place.files("served").size();
    for (size_t i = 0; i < count; ++i) {
        CAPTURE(i);
        const std::string name = fmt::format("{:04}.png", i % frames);  // the sequence begins anew, with a reset
        const std::string served = place.bytes(fmt::format("served/{:04}.png", i));
        const bool is_nearest = served == place.bytes("by nearest/" + name);
        CHECK((is_nearest || (by_nearest == 0 && served == place.bytes("by network/" + name))));
        ++(is_nearest ? by_nearest : by_network);
    }
    CHECK(by_network >= 8);
    CHECK(by_nearest >= 8);
}

TEST_CASE("what control cannot change stays as it is") {
    const Workplace place(4);
    const fs::path here = fs::current_path();
    const auto server = place.serve("bilinear", "served");
    REQUIRE(comes_true([&] { return fs::exists(place.runtime / "game.control"); }));
    CHECK(contains(control({"game", "model=nearest"}).errors, "no renderer shares game yet"));
    CHECK(contains(control({"game"}).out, "waiting for a renderer"));
    const auto player = place.play({"--loop", "--frame-rate", "50"});
    REQUIRE(comes_true([&] { return state()["frames"] > 2; }));
    const auto refused = [](const std::string& change, const std::string& words, int code = 1) {
        const Outcome outcome = control({"game", change});
        CHECK(outcome.code == code);
        CHECK_MESSAGE(contains(outcome.errors, words), outcome.errors);
    };
    refused("model=no-such-model", "no-such-model");
    refused("scale=two", "scale=two: it is as in scale=2, or auto");
    refused("output-size=1x", "output-size=1x");
    refused("output-size=20000x20000", "more than a kernel can count");
    refused("colour=blue", "there is no colour to change");
    refused("model=" CLARUS_GOLDEN_DIR "/enss_x3_table.model.safetensors", "upscales by 3, but the stream game");
    refused("model", "is not of the form model=NAME", 2);
    CHECK(control({"game", "scale=3"}).code == 0);
    refused("model=" + network, "scale=auto takes that back");
    CHECK(control({"game", "scale=auto"}).code == 0);
    fs::current_path(CLARUS_GOLDEN_DIR);  // the server is in another folder
    CHECK(control({"game", "model=enss_x2_table.model.safetensors"}).code == 0);
    fs::current_path(here);
    CHECK(control({"game", "model=bilinear"}).code == 0);
    REQUIRE(comes_true([&] { return state()["changes"] >= 1; }));
    CHECK(state()["model"] == "bilinear");
    player->interrupt();
    CHECK(player->result() == 0);
    CHECK(server->result() == 0);
    CHECK(contains(control({"game"}).errors, "nobody serves game"));
    CHECK(place.runtime.is_empty());
}

TEST_CASE("a stream without what the model needs is refused, and its renderer told") {
    const Workplace place(4);
    json description = place.description();
    for (json& frame : description["frames"]) frame.erase("motion");
    place.describe(description);
    const auto server = place.serve(network, "served");
    const auto player = place.play();
    CHECK(server->result() == 1);
    const std::string words = "model enss_x2_table.model needs motion, which the stream game does not have";
    CHECK_MESSAGE(contains(server->errors(), words), server->errors());
    CHECK(place.files("served").empty());
    REQUIRE(comes_true([&] { return contains(player->errors(), "the upscaler left: " + words); }));
    const auto patient = place.serve(network, "served", {"--keep"});
    REQUIRE(comes_true([&] { return fs::exists(place.runtime / "game.control"); }));
    REQUIRE(comes_true([&] { return contains(patient->errors(), words + "; waiting for another renderer of game"); }));
    patient->interrupt();
    CHECK(patient->result() == 0);
    const auto filter = place.serve("bilinear", "served");  // which needs none
    CHECK(filter->result() == 0);
    CHECK(player->result() == 0);
    CHECK(place.files("served").size() == 4);
}

TEST_CASE("an upscaler that is killed and comes back misses no frame that it had not upscaled") {
    const Workplace place(20);
    place.upscale("bilinear", "upscaled");
    auto server = place.serve("bilinear", "served");
    const auto player = place.play({"--frame-rate", "20"});
    REQUIRE(comes_true([&] { return place.files("served").size() >= 4; }));
    server->kill();
    const std::set<std::string> before = place.files("served");
    server = place.serve("bilinear", "served");
    CHECK(player->result() == 0);
    CHECK(server->result() == 0);
    int missing = 0;
    for (const std::string& name : place.files("upscaled")) {
        if (place.files("served").contains(name))
            CHECK(place.bytes("upscaled/" + name) == place.bytes("served/" + name));
        else
            ++missing;
    }
    const auto cores = static_cast<int>(std::thread::hardware_concurrency());
    CHECK(missing <= cores + 1);  // pictures that were being written
    CHECK(place.files("served").size() > before.size());
    CHECK(place.runtime.is_empty());
}

TEST_CASE("a disk that fills ends the upscaler, and its renderer is told") {
    const Workplace place(1);
    write_noise_sequence(place / "sequence", {480, 270}, 4);
    const std::string tool = CLARUS_TOOL, output = (place / "served").string();
    Program server("/bin/sh",  // a picture has 3.7 MB, a file at most 2 MiB
                   {"-c", "ulimit -f 4096; trap '' XFSZ; exec '" + tool +
                              "' serve game --model nearest --scale 3 --png-compression 0 --device '" +
                              test_selector() + "' --output '" + output + "'"});
    const auto player = place.play({"--loop"});
    CHECK(server.result() == 1);
    CHECK_MESSAGE(contains(server.errors(), "cannot write " + output), server.errors());
    REQUIRE(comes_true([&] { return contains(player->errors(), "the upscaler left: cannot write " + output); }));
    CHECK(place.files("served").empty());
    player->interrupt();
    CHECK(player->result() == 0);
}

TEST_CASE("a renderer that is killed and comes back goes on, with a reset") {
    const Workplace place(6);
    const auto server = place.serve(network, "served");
    auto player = place.play({"--loop", "--frame-rate", "20"});
    REQUIRE(comes_true([&] { return state()["frames"] > 8; }));
    player->kill();
    REQUIRE(comes_true([] { return state()["connected"] == false; }));
    player = place.play();
    CHECK(player->result() == 0);
    CHECK(server->result() == 0);
    place.upscale(network, "upscaled");
    for (const std::string& name : place.files("upscaled"))  // as if nothing had been before
        CHECK(place.bytes("upscaled/" + name) == place.bytes("served/" + name));
}

TEST_CASE("a name that is served, or shared, is in use") {
    const Workplace place(4);
    const auto server = place.serve("bilinear", "served"), player = place.play({"--loop", "--frame-rate", "20"});
    REQUIRE(comes_true([&] { return place.files("served").size() >= 4; }));
    const auto other_server = place.serve("bilinear", "other"), other_player = place.play();
    CHECK(other_server->result() == 1);
    CHECK(contains(other_server->errors(), "game is served by another process already"));
    CHECK(other_player->result() == 1);
    CHECK(contains(other_player->errors(), "the name game is in use by another process"));
    server->interrupt();
    CHECK(server->result() == 0);
    player->interrupt();
    CHECK(player->result() == 0);
    CHECK(place.runtime.is_empty());
    Program wrong(CLARUS_TOOL, {"serve", "a/b", "--model", "bilinear"});
    CHECK(wrong.result() == 1);
    CHECK(contains(wrong.errors(), "the stream name \"a/b\""));
    const auto refused = [](std::vector<std::string> arguments, const std::string& words) {
        arguments.insert(arguments.begin(), {"serve", "game", "--model", "bilinear"});
        Program program(CLARUS_TOOL, arguments);
        CHECK(program.result() == 1);
        CHECK_MESSAGE(contains(program.errors(), words), program.errors());
    };
    refused({"--device", "no-such-device"}, "no-such-device");
    refused({"--output", "film.avi"}, "film.avi: .avi files are not written");
}

TEST_CASE("frames say how long the renderer's rate lets them last, and numbers that begin anew are told") {
    const Workplace place(3);
    const auto player = place.play({"--frame-rate", "50"});
    const SharedReader reader = open_reader("game");
    REQUIRE(clarus_share_reader_connect(reader.get(), 60000) == CLARUS_SHARE_OK);
    for (int i = 0; i < 3; ++i) {
        clarus_share_frame frame;
        REQUIRE(clarus_share_reader_wait(reader.get(), 60000, &frame) == CLARUS_SHARE_OK);
        CHECK(frame.frame_seconds == doctest::Approx(0.02));
        CHECK(clarus_share_reader_release(reader.get()) == CLARUS_SHARE_OK);
    }
    CHECK(player->result() == 0);

    const auto server = place.serve("bilinear", "served", {"--keep"});
    for (int times = 0; times < 2; ++times) CHECK(place.play()->result() == 0);
    REQUIRE(comes_true([&] { return state()["frames"] == 6; }));
    server->interrupt();
    CHECK(server->result() == 0);
    CHECK(contains(server->errors(), "frame 0 follows frame 2: pictures of these numbers in"));
}

TEST_CASE("a renderer in C is served") {
    const Workplace place(1);
    const auto server = place.serve("bilinear", "served");
    Program renderer(CLARUS_TINY_RENDERER, {"game", "5"});
    CHECK(renderer.result() == 0);
    CHECK(server->result() == 0);
    CHECK(place.files("served").size() == 5);
    CHECK(io::read_image_header(place / "served/0004.png").size == Size{640, 360});
    CHECK(io::read_image(place / "served/0004.png").at(320, 180, 1) == doctest::Approx(0.5).epsilon(0.01));
}

TEST_CASE("what the sample renderer shares is what it writes") {
    const Workplace place(1);
    const auto render = [&](std::vector<std::string> arguments) {
        arguments.insert(arguments.begin(), {"render", "--scene", "demo", "--size", "48x32", "--hdr", "--frames", "3",
                                             "--no-reference", "--depth", "projective", "--motion-jittered"});
        return std::make_unique<Program>(CLARUS_TOOL, arguments);
    };
    fs::remove_all(place / "sequence");
    CHECK(render({"-o", place.sequence()})->result() == 0);
    const io::Sequence sequence = io::read_sequence(place.sequence());
    const auto renderer = render({"--share", "game"});
    const SharedReader reader = open_reader("game");
    REQUIRE(clarus_share_reader_connect(reader.get(), 60000) == CLARUS_SHARE_OK);
    const clarus_share_description& description = *clarus_share_reader_description(reader.get());
    CHECK(description.linear_color == 1);
    CHECK(description.depth_projective == 1);
    CHECK(description.motion_jittered == 1);
    for (size_t i = 0; i < 3; ++i) {
        clarus_share_frame frame;
        REQUIRE(clarus_share_reader_wait(reader.get(), 60000, &frame) == CLARUS_SHARE_OK);
        CHECK(frame.number == i);
        CHECK(frame.jitter_x == doctest::Approx(sequence.frames[i].jitter.x));
        CHECK(frame.far_plane == sequence.frames[i].far_plane);
        const io::FramePixels written = io::read_frame(sequence, i, true, false);
        const auto check = [&](clarus_share_kind kind, const io::Pixels& pixels, double tolerance) {
            const auto* shared = static_cast<const float*>(frame.images[kind].pixels);
            for (size_t k = 0; k < pixels.values.size(); ++k)
                CHECK(shared[k] == doctest::Approx(pixels.values[k]).epsilon(tolerance));
        };
        check(CLARUS_SHARE_COLOR, written.color, 1e-3);  // which the file has in half
        check(CLARUS_SHARE_DEPTH, written.depth, 1e-6);
        check(CLARUS_SHARE_MOTION, written.motion, 1e-6);
        CHECK(clarus_share_reader_release(reader.get()) == CLARUS_SHARE_OK);
    }
    CHECK(renderer->result() == 0);
    CHECK(render({})->result() == 2);
}
