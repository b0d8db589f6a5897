#include <cstdlib>
#include <map>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "clarus/error.h"
#include "link/address.h"
#include "network.h"
#include "share_programs.h"

// Frames that go to another machine: `clarus serve --listen`, `clarus relay` and `--share ucx:…` as processes, all on
// this machine or on two network namespaces.

using namespace clarus;
using namespace clarus::test;
using namespace std::chrono_literals;
namespace fs = std::filesystem;

namespace {

const std::string network_model = CLARUS_GOLDEN_DIR "/enss_x2_table.model.safetensors";

/// `machine`: what its commands begin with, if it is not this one.
std::unique_ptr<Program> start(std::vector<std::string> arguments, const std::vector<std::string>& machine = {}) {
    if (machine.empty()) return std::make_unique<Program>(CLARUS_TOOL, arguments);
    arguments.insert(arguments.begin(), CLARUS_TOOL);
    arguments.insert(arguments.begin(), machine.begin() + 1, machine.end());
    return std::make_unique<Program>(machine.front(), arguments);
}

/// Whoever listens for a renderer elsewhere.
struct Place : Workplace {
    using Workplace::Workplace;

    std::string port = free_port();
    std::string at = "127.0.0.1:" + port;
    std::vector<std::string> game_machine, upscaler_machine;

    std::unique_ptr<Program> listen(const std::string& model, const std::string& output) const {
        return start({"serve", "game", "--model", model, "--device", test_selector(), "--output",
                      (*this / output).string(), "--listen", at},
                     upscaler_machine);
    }
    std::unique_ptr<Program> play_to(std::vector<std::string> more = {}) const {
        more.insert(more.begin(), {"play", sequence(), "--share", "ucx:" + at + "/game"});
        return start(more, game_machine);
    }
    bool has(const std::string& output, size_t count) const {
        return comes_true([&] { return files(output).size() >= count; });
    }
    /// Frames that were upscaled are those of `whole`, but for what may be missing.
    void check_is_part(const std::string& part, const std::string& whole, size_t most_missing) const {
        size_t missing = 0;
        for (const std::string& name : files(whole))
            if (!files(part).contains(name))
                ++missing;
            else
                CHECK_MESSAGE(bytes(part + "/" + name) == bytes(whole + "/" + name), name);
        CHECK(missing <= most_missing);
    }
};

const size_t pictures_being_written = std::thread::hardware_concurrency() + 1;

}  // namespace

TEST_CASE("where frames go to is told as HOST:PORT") {
    using link::parse_address;
    CHECK(parse_address("7788", "--listen").text() == "127.0.0.1:7788");
    CHECK(parse_address(":7788", "--listen").text() == "127.0.0.1:7788");
    CHECK(parse_address("there.example:1", "--listen").text() == "there.example:1");
    CHECK(parse_address("[::1]:7788", "--listen").host == "::1");
    CHECK(parse_address("[::1]:7788", "--listen").text() == "[::1]:7788");
    for (const char* wrong : {"", ":", "here:", "here:0", "here:65536", "here:x", "here"})
        CHECK_THROWS_WITH_AS(parse_address(wrong, "--listen"), doctest::Contains("--listen"), Error);
    CHECK_FALSE(link::parse_remote_stream("game", "--share"));
    CHECK(link::parse_remote_stream("ucx:10.0.0.2:7788/game", "--share")->address.text() == "10.0.0.2:7788");
    CHECK(link::parse_remote_stream("ucx:10.0.0.2:7788/game", "--share")->name == "game");
    for (const char* wrong : {"ucx:", "ucx:10.0.0.2:7788", "ucx:10.0.0.2/game", "ucx:10.0.0.2:7788/a/b"})
        CHECK_THROWS_WITH_AS(link::parse_remote_stream(wrong, "--share"), doctest::Contains("--share"), Error);
    CHECK(link::device_at(link::resolve({"127.0.0.1", "1"})) == "lo");
    CHECK(link::device_towards(link::resolve({"127.0.0.1", "1"})) == "lo");
}

#ifdef CLARUS_STRANGER

TEST_CASE("what comes from another machine is upscaled to the same bytes as files") {
    Place place(5);
    place.upscale(network_model, "upscaled");
    for (const bool is_relayed : {false, true}) {
        CAPTURE(is_relayed);
        fs::remove_all(place / "served");
        std::unique_ptr<Program> relay, player;
        if (is_relayed) {  // before the one that listens
            player = start({"play", place.sequence(), "--share", "here", "--slots", "2"});
            relay = start({"relay", "here", "--to", place.at + "/game"});
        }
        const auto server = place.listen(network_model, "served");
        if (!is_relayed) player = place.play_to();
        CHECK(player->result() == 0);
        CHECK(server->result() == 0);
        if (relay) CHECK(relay->result() == 0);
        if (relay) CHECK(contains(relay->out(), "5 frames sent to " + place.at));
        CHECK(contains(player->out(), "5 frames shared, 5 upscaled"));
        check_same_files(place, "upscaled", "served", 5);
        CHECK(place.runtime.is_empty());
    }
}

TEST_CASE("an upscaler on another machine that is killed and comes back misses no frame that it had not upscaled") {
    Place place(20);
    place.upscale("bilinear", "upscaled");
    auto server = place.listen("bilinear", "served");
    const auto player = place.play_to({"--frame-rate", "20"});
    REQUIRE(place.has("served", 4));
    server->kill();
    server = place.listen("bilinear", "served");
    CHECK(player->result() == 0);
    CHECK(server->result() == 0);
    place.check_is_part("served", "upscaled", pictures_being_written);
    CHECK(place.runtime.is_empty());
}

TEST_CASE("a renderer on another machine that is killed and comes back goes on, with a reset") {
    Place place(6);
    const auto server = place.listen(network_model, "served");
    auto player = place.play_to({"--loop", "--frame-rate", "50"});
    REQUIRE(place.has("served", 8));
    player->kill();
    player = place.play_to();
    CHECK(player->result() == 0);
    CHECK(server->result() == 0);
    place.upscale(network_model, "upscaled");
    place.check_is_part("served", "upscaled", 0);  // as if nothing had been before
}

TEST_CASE("renderer and upscaler that are killed at random instants find each other again") {
    Place place(4);
    const auto listen = [&] {
        return start({"serve", "game", "--model", "bilinear", "--device", test_selector(), "--listen", place.at});
    };
    const auto play = [&] { return place.play_to({"--loop", "--frame-rate", "200"}); };
    const auto frames = [] {
        const auto control = start({"control", "game", "--json"});
        return control->result() == 0 ? nlohmann::json::parse(control->out())["frames"].get<int>() : 0;
    };
    const char* variable = std::getenv("CLARUS_KILLS");
    const int kills = variable ? std::atoi(variable) : 6;
    std::mt19937 random(1);
    auto server = listen(), player = play();
    for (int i = 0; i < kills; ++i) {
        CAPTURE(i);
        const bool is_upscaler = random() % 2 == 0;
        (is_upscaler ? server : player)->kill();
        (is_upscaler ? server : player) = is_upscaler ? listen() : play();
        const int before = is_upscaler ? 0 : frames();
        REQUIRE(comes_true([&] { return frames() > before; }));
        std::this_thread::sleep_for(std::chrono::milliseconds(random() % 200));
    }
    player->interrupt();
    CHECK(player->result() == 0);
    CHECK(server->result() == 0);
    CHECK(place.runtime.is_empty());
}

TEST_CASE("only the newest frames come where the renderer does not wait") {
    Place place(30);
    place.upscale("bilinear", "upscaled");
    const auto server = place.listen("bilinear", "served");
    const auto player = place.play_to({"--newest", "--frame-rate", "100"});
    CHECK(player->result() == 0);
    CHECK(server->result() == 0);
    CHECK(place.files("served").contains("0029.png"));
    place.check_is_part("served", "upscaled", 29);
}

TEST_CASE("what another machine says that cannot be is refused, and the next is let in") {
    Place place(4);
    const auto server = place.listen("bilinear", "served");
    const std::map<std::string, std::string> kinds{{"random", "does not speak Clarus's protocol"},
                                                   {"magic", "does not speak Clarus's protocol"},
                                                   {"version", "speaks version 3 of the protocol"},
                                                   {"type", "a packet of type 99"},
                                                   {"bytes", "a packet of type 16"},
                                                   {"truncated", "a packet of type 16"},
                                                   {"name", "game is served here, not ????"},
                                                   {"width", "color: -1x16 pixels"},
                                                   {"pixels", "color: "},
                                                   {"format", "color: element type 77"},
                                                   {"channels", "color: 9 channels"},
                                                   {"pitch", "color: row pitch"},
                                                   {"slots", "1000 slots"},
                                                   {"slot size", "a stream whose slots have"},
                                                   {"user data", "bytes of user data"},
                                                   {"hello again", "a message that is not due"},
                                                   {"frame without data", "a frame that cannot be"},
                                                   {"frame too long", "a frame that cannot be"},
                                                   {"frame too short", "a frame that cannot be"},
                                                   {"frame index", "a frame that cannot be"},
                                                   {"frame width", "a frame that cannot be"},
                                                   {"frame jitter", "a frame that cannot be"},
                                                   {"frame user data", "a frame that cannot be"}};
    REQUIRE(comes_true([&] { return fs::exists(place.runtime / "game.control"); }));
    for (const auto& [kind, words] : kinds) {
        CAPTURE(kind);
        Program stranger(CLARUS_STRANGER, {place.port, "game", kind});
        CHECK(stranger.result() == 0);
        CHECK_MESSAGE(contains(stranger.out(), words), stranger.out());
    }
    place.upscale("bilinear", "upscaled");
    const auto player = place.play_to();
    CHECK(player->result() == 0);
    CHECK(server->result() == 0);
    CHECK(contains(server->errors(), "a machine that wanted to send frames of game is refused"));
    place.check_is_part("served", "upscaled", 0);
}

TEST_CASE("who cannot be served is told") {
    Place place(4);
    const auto failed = [](const std::vector<std::string>& arguments, const std::string& words) {
        const auto program = start(arguments);
        CHECK(program->result() == 1);
        CHECK_MESSAGE(contains(program->errors(), words), program->errors());
    };
    failed({"serve", "game", "--model", "bilinear", "--listen", "here"}, "--listen here: not HOST:PORT");
    failed({"serve", "game", "--model", "bilinear", "--listen", "192.0.2.1:7788"}, "cannot listen at 192.0.2.1:7788");
    failed({"play", place.sequence(), "--share", "ucx:127.0.0.1/game"}, "--share 127.0.0.1: not HOST:PORT");
    failed({"relay", "game", "--to", "127.0.0.1"}, "--to 127.0.0.1");

    const auto server = place.listen("bilinear", "served");
    const auto player = place.play_to({"--loop", "--frame-rate", "50"});
    REQUIRE(place.has("served", 4));
    failed({"serve", "other", "--model", "bilinear", "--listen", place.at},
           "cannot listen at " + place.at + ": another process does");
    failed({"play", place.sequence(), "--share", "ucx:" + place.at + "/game"}, "is in use by another process");
    const auto second = start({"play", place.sequence(), "--share", "ucx:127.1:" + place.port + "/game"});
    const auto lost = start({"play", place.sequence(), "--share", "ucx:" + place.at + "/other"});
    CHECK(comes_true([&] { return contains(second->errors(), "has a renderer on another machine already"); }));
    CHECK(comes_true([&] { return contains(lost->errors(), "game is served here, not other"); }));
    for (const auto& program : {&second, &lost}) {
        (*program)->interrupt();
        CHECK((*program)->result() == 0);
    }
    player->interrupt();
    CHECK(player->result() == 0);
    CHECK(server->result() == 0);
}

TEST_CASE("a stream that the upscaler cannot take is refused by it, and its renderer elsewhere told") {
    Place place(4);
    nlohmann::json description = place.description();
    for (nlohmann::json& frame : description["frames"]) frame.erase("motion");
    place.describe(description);
    const auto server = place.listen(network_model, "served");
    const auto player = place.play_to();
    const std::string words = "model enss_x2_table.model needs motion";
    CHECK(server->result() == 1);
    CHECK_MESSAGE(contains(server->errors(), words), server->errors());
    CHECK(comes_true([&] { return contains(player->errors(), words); }));
    const auto filter = place.listen("bilinear", "served");
    CHECK(filter->result() == 0);
    CHECK(player->result() == 0);
    CHECK(place.files("served").size() == 4);
}

TEST_CASE("a cable that takes its time, and one that is cut") {
    std::string why;
    const std::unique_ptr<Network> network = Network::make(why);
    if (!network) {
        MESSAGE("skipped: ", why);
        return;
    }
    Place place(40);
    place.at = Network::address(1) + ":7788";
    place.game_machine = network->on(0);
    place.upscaler_machine = network->on(1);
    network->delay(5ms);
    place.upscale("bilinear", "upscaled");
    {
        const auto server = place.listen("bilinear", "served"), player = place.play_to();
        CHECK(player->result() == 0);
        CHECK(server->result() == 0);
        check_same_files(place, "upscaled", "served", 40);
    }
    fs::remove_all(place / "served");
    const auto server = place.listen("bilinear", "served");
    const auto player = place.play_to({"--frame-rate", "20"});
    REQUIRE(place.has("served", 4));
    network->cut(true);
    CHECK(comes_true([&] { return contains(player->errors(), "nothing is heard of the other side"); }));
    network->cut(false);
    CHECK(player->result() == 0);
    CHECK(server->result() == 0);
    check_same_files(place, "upscaled", "served", 40);
}

#endif
