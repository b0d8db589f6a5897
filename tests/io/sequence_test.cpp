#include "io/sequence.h"

#include <doctest/doctest.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>

#include "clarus/error.h"
#include "io/file.h"
#include "temporary_folder.h"

using namespace clarus;
using namespace clarus::io;
using doctest::Contains;
using nlohmann::json;

namespace {

json frame(int index) {
    const std::string number = "000" + std::to_string(index);
    return {{"color", "color/" + number + ".png"},
            {"depth", "depth/" + number + ".exr"},
            {"motion", "motion/" + number + ".exr"},
            {"jitter", {0.25, -0.125 * index}},
            {"reference", "reference/" + number + ".png"}};
}

/// The description in docs/formats.md, "A sequence", of three frames.
json description() {
    return {
        {"version", 1},
        {"render_size", {960, 540}},
        {"scale", 2},
        {"frame_rate", 30},
        {"mip_bias", -1.5},
        {"color_space", "srgb"},
        {"depth", {{"encoding", "linear"}, {"reversed", true}}},
        {"motion",
         {{"unit", "uv"}, {"direction", "from_previous"}, {"y", "up"}, {"jittered", true}, {"sampled_at", "jittered"}}},
        {"frames", {frame(0), frame(1), frame(2)}}};
}

class Description {
  public:
    explicit Description(const std::string& text) { std::ofstream(folder_ / "sequence.json") << text; }
    const std::filesystem::path& folder() const { return folder_.path(); }
    Sequence read() const { return read_sequence(folder()); }

  private:
    TemporaryFolder folder_;
};

/// The message for a description that was changed at one place.
doctest::String message_with(const std::string& place, const json& value) {
    json text = description();
    text[json::json_pointer(place)] = value;
    try {
        Description(text.dump()).read();
    } catch (const Error& error) {
        CHECK(error.kind() == ErrorKind::file);
        CHECK(std::string(error.what()).find("sequence.json") != std::string::npos);
        return error.what();
    }
    return "no error";
}

doctest::String message_without(const std::string& object, const char* key) {
    json text = description();
    text[json::json_pointer(object)].erase(key);
    try {
        Description(text.dump()).read();
    } catch (const Error& error) {
        return error.what();
    }
    return "no error";
}

}  // namespace

TEST_CASE("a native sequence says what its JSON says") {
    json text = description();
    text["frames"][1]["exposure"] = 1.5;
    text["frames"][2]["reset"] = true;
    text["frames"][2]["ui"] = "ui/0002.png";
    const Description file(text.dump());
    const Sequence sequence = file.read();
    CHECK(sequence.render_size == Size{960, 540});
    CHECK(sequence.output_size() == Size{1920, 1080});
    CHECK(sequence.scale == 2);
    CHECK(sequence.frame_rate == 30);
    CHECK(sequence.mip_bias == -1.5);
    CHECK(sequence.color_space == ColorSpace::srgb);
    CHECK_FALSE(sequence.depth.projective);
    CHECK(sequence.depth.reversed);
    REQUIRE(sequence.frames.size() == 3);
    CHECK(sequence.frames[1].color == file.folder() / "color/0001.png");
    CHECK(sequence.frames[1].depth == file.folder() / "depth/0001.exr");
    CHECK(sequence.frames[1].motion == file.folder() / "motion/0001.exr");
    CHECK(sequence.frames[1].reference == file.folder() / "reference/0001.png");
    CHECK(sequence.frames[1].jitter == Vec2{0.25f, -0.125f});
    CHECK(sequence.frames[1].exposure == 1.5f);
    CHECK(sequence.frames[1].name == "0001");
    CHECK(sequence.frames[0].reset);  // though the JSON does not say it
    CHECK_FALSE(sequence.frames[1].reset);
    CHECK(sequence.frames[2].reset);
    CHECK(sequence.frames[2].optional.at("ui") == file.folder() / "ui/0002.png");

    // The JSON itself may be named, whatever it is called.
    CHECK(read_sequence(file.folder() / "sequence.json").frames.size() == 3);
    std::filesystem::rename(file.folder() / "sequence.json", file.folder() / "other.json");
    CHECK(read_sequence(file.folder() / "other.json").frames.size() == 3);
    CHECK(read_sequence(file.folder() / "other.json", Layout::native).frames.size() == 3);
    std::ofstream(file.folder() / "other.json") << "{\"frames\": ";
    CHECK_THROWS_WITH_AS(read_sequence(file.folder() / "other.json"), Contains("other.json is not valid JSON"), Error);
}

TEST_CASE("what a native sequence need not say") {
    json text = description();
    for (const char* key : {"frame_rate", "mip_bias"}) text.erase(key);
    text["depth"].erase("encoding");
    text["motion"].erase("sampled_at");
    const Sequence sequence = Description(text.dump()).read();
    CHECK(sequence.frame_rate == 60);
    CHECK_FALSE(sequence.mip_bias);
    CHECK_FALSE(sequence.depth.projective);
    CHECK_FALSE(sequence.motion.sampled_at_jitter);
    text["depth"].erase("reversed");
    CHECK_FALSE(Description(text.dump()).read().depth.reversed);

    // Colour alone: then nothing of depth and motion.
    for (const char* key : {"depth", "motion"}) {
        text.erase(key);
        for (json& one : text["frames"]) one.erase(key);
    }
    CHECK(Description(text.dump()).read().frames[2].depth.empty());
}

TEST_CASE("planes of projective depth go to every frame") {
    json text = description();
    text["depth"] = {{"encoding", "projective"}, {"reversed", true}, {"near", 0.5}, {"far", 200}};
    const Sequence bounded = Description(text.dump()).read();
    CHECK(bounded.depth.projective);
    CHECK(bounded.frames[2].near_plane == 0.5f);
    CHECK(bounded.frames[2].far_plane == 200);
    text["depth"]["far"] = nullptr;
    CHECK(Description(text.dump()).read().frames[2].far_plane == std::numeric_limits<float>::infinity());

    const auto message = [](double near, double far) {
        return message_with("/depth", {{"encoding", "projective"}, {"reversed", false}, {"near", near}, {"far", far}});
    };
    CHECK(message(1, 0.5) == Contains("depth.far must be farther than near"));
    CHECK(message(1, 1) == Contains("depth.far must be farther than near"));
    CHECK(message(0, 1) == Contains("depth.near must be a positive number, not 0"));
    CHECK(message_with("/depth", {{"encoding", "projective"}, {"reversed", false}, {"near", 1}}) ==
          Contains("depth lacks the field \"far\""));
}

TEST_CASE("motion conventions become a scale: canonical = scale times stored") {
    struct Case {
        const char *unit, *direction, *y;
        Vec2 scale;
    };
    for (const Case& one :
         {Case{"pixels", "to_previous", "down", {1, 1}}, Case{"pixels", "to_previous", "up", {1, -1}},
          Case{"pixels", "from_previous", "down", {-1, -1}}, Case{"uv", "to_previous", "down", {960, 540}},
          Case{"uv", "from_previous", "up", {-960, 540}}}) {
        json text = description();
        text["motion"] = {{"unit", one.unit}, {"direction", one.direction}, {"y", one.y}, {"jittered", false}};
        const MotionEncoding encoding = Description(text.dump()).read().motion_encoding();
        CHECK(encoding.scale == one.scale);
        CHECK_FALSE(encoding.jittered);
        CHECK_FALSE(encoding.sampled_at_jitter);
    }
    const MotionEncoding encoding = Description(description().dump()).read().motion_encoding();
    CHECK(encoding.jittered);
    CHECK(encoding.sampled_at_jitter);
}

TEST_CASE("outputs are numbered like the colour images where these are numbered") {
    json text = description();
    for (int i = 0; i < 3; ++i) text["frames"][i]["color"] = "color/00" + std::to_string(40 + i) + ".png";
    CHECK(Description(text.dump()).read().frames[2].name == "0042");
    text["frames"][1]["color"] = "color/view.png";
    CHECK(Description(text.dump()).read().frames[2].name == "0002");
    text["frames"][1]["color"] = "other/0040.png";
    CHECK(Description(text.dump()).read().frames[2].name == "0002");
}

TEST_CASE("a description that is none") {
    CHECK_THROWS_WITH_AS(read_sequence("/nonexistent/seq"), Contains("/nonexistent/seq: no such file"), Error);
    CHECK_THROWS_WITH_AS(read_sequence("/nonexistent/seq", Layout::native), Contains("/nonexistent/seq"), Error);
    const TemporaryFolder empty;
    CHECK_THROWS_WITH_AS(read_sequence(empty.path()), Contains("cannot tell the layout"), Error);
    CHECK_THROWS_WITH_AS(read_sequence(empty.path(), Layout::native), Contains("sequence.json: No such file"), Error);
    CHECK_THROWS_WITH_AS(Description("").read(), Contains("sequence.json is not valid JSON"), Error);
    CHECK_THROWS_WITH_AS(Description("render_size: 3").read(), Contains("is not valid JSON"), Error);
    CHECK_THROWS_WITH_AS(Description(description().dump() + std::string("\0garbage", 8)).read(),
                         Contains("is not valid JSON"), Error);
    CHECK_THROWS_WITH_AS(Description("{\"scale\": 1e999}").read(), Contains("is not valid JSON"), Error);
    CHECK_THROWS_WITH_AS(Description("{\"scale\": 2, \"scale\": 3}").read(), Contains("\"scale\" stands twice"), Error);
    for (const char* extra : {"", "\"extra\": "}) {
        const std::string deep = std::string(200'000, '[') + std::string(200'000, ']');
        CHECK_THROWS_WITH_AS(Description(*extra ? std::string("{") + extra + deep + "}" : deep).read(),
                             Contains("nest more than 64 deep"), Error);
    }
    CHECK_THROWS_WITH_AS(Description("[1, 2]").read(), Contains("the top level must be an object"), Error);
}

TEST_CASE("a missing field is named with its place") {
    CHECK(message_without("", "version") == Contains("the top level lacks the field \"version\""));
    for (const char* key : {"render_size", "scale", "color_space", "depth", "motion", "frames"})
        CHECK(message_without("", key) == Contains(key));
    CHECK(message_with("/depth", {{"encoding", "projective"}, {"near", 1}, {"far", 2}}) ==
          Contains("depth lacks the field \"reversed\""));
    for (const char* key : {"unit", "direction", "y", "jittered"})
        CHECK(message_without("/motion", key) == Contains(key));
    CHECK(message_without("/frames/2", "color") == Contains("frames[2] lacks the field \"color\""));
    CHECK(message_without("/frames/1", "jitter") == Contains("frames[1] lacks the field \"jitter\""));
}

TEST_CASE("a field that there is not is an error that suggests the nearest") {
    struct Case {
        const char *place, *message;
    };
    for (const Case& one :
         {Case{"/renderSize", "the top level has the unknown field \"renderSize\"; is it render_size?"},
          Case{"/colour_space", "the top level has the unknown field \"colour_space\"; is it color_space?"},
          Case{"/depth/reverse", "depth has the unknown field \"reverse\"; is it reversed?"},
          Case{"/motion/units", "motion has the unknown field \"units\"; is it unit?"},
          Case{"/motion/sampled-at", "motion has the unknown field \"sampled-at\"; is it sampled_at?"},
          Case{"/frames/1/colour", "frames[1] has the unknown field \"colour\"; is it color?"},
          Case{"/frames/2/jiter", "frames[2] has the unknown field \"jiter\"; is it jitter?"}})
        CHECK(message_with(one.place, 1) == Contains(one.message));
    CHECK(message_with("/depth/comment", "no") ==
          Contains("unknown field \"comment\"; there are encoding, reversed, near, far"));
    CHECK(message_with("/", "an empty name") == Contains("unknown field \"\"; there are version, render_size"));
    CHECK(message_with("/" + std::string(100'000, 'x'), 1) == Contains("x…; there are version"));
    CHECK(message_with("/frames/0/camera", {{"fov_x", 1}}) ==
          Contains("frames[0].camera has the unknown field \"fov_x\""));
}

TEST_CASE("a value that does not fit is named with its place, what it is and what it must be") {
    CHECK(message_with("/version", 2) == Contains("version must be 1, not 2"));
    CHECK(message_with("/version", "1") == Contains("version must be 1, not \"1\""));
    CHECK(message_with("/render_size", 960) == Contains("render_size must be a list of 2, not 960"));
    CHECK(message_with("/render_size/1", -540) == Contains("render_size[1] must be a whole number from 1"));
    CHECK(message_with("/render_size/0", 0) == Contains("render_size[0] must be"));
    CHECK(message_with("/render_size/0", 960.5) == Contains("render_size[0] must be a whole number"));
    CHECK(message_with("/render_size/0", 18446744073709551615ull) == Contains("render_size[0] must be"));
    CHECK(message_with("/render_size/0", 1e30) == Contains("render_size[0] must be"));
    CHECK(message_with("/scale", "2") == Contains("scale must be a number from 1 to 32768, not \"2\""));
    CHECK(message_with("/scale", 0.5) == Contains("scale must be"));
    CHECK(message_with("/scale", 1e300) == Contains("scale must be"));
    CHECK(message_with("/mip_bias", -17) == Contains("mip_bias must be a number from -16 to 16, not -17"));
    CHECK(message_with("/frame_rate", 0) == Contains("frame_rate must be a positive number"));
    CHECK(message_with("/color_space", "p3") ==
          Contains("color_space must be one of \"srgb\", \"linear\", not \"p3\""));
    CHECK(message_with("/depth", "linear") == Contains("depth must be an object, not \"linear\""));
    CHECK(message_with("/depth/encoding", "logarithmic") == Contains("depth.encoding must be one of \"linear\""));
    CHECK(message_with("/depth/reversed", 1) == Contains("depth.reversed must be true or false, not 1"));
    CHECK(message_with("/depth/channels", {"Z", "Y"}) ==
          Contains("depth.channels must be a list of one channel's name"));
    CHECK(message_with("/depth/channels", "Z") == Contains("depth.channels must be a list"));
    CHECK(message_with("/motion/channels", {"X", "X"}) == Contains("motion.channels must be a list of two different"));
    CHECK(message_with("/color", {{"channels", {"R", "G"}}}) ==
          Contains("color.channels must be a list of three or four different channels' names"));
    CHECK(message_with("/color", {{"part", ""}}) == Contains("color.part must be the name of a part"));
    CHECK(message_with("/color", {{"chanels", {"R", "G", "B"}}}) == Contains("channels"));
    CHECK(message_with("/motion/unit", "ndc") ==
          Contains("motion.unit must be one of \"pixels\", \"uv\", not \"ndc\""));
    CHECK(message_with("/motion/direction", 1) == Contains("motion.direction must be one of"));
    CHECK(message_with("/motion/y", "left") == Contains("motion.y must be one of \"down\", \"up\""));
    CHECK(message_with("/motion/sampled_at", "center") ==
          Contains("motion.sampled_at must be one of \"centre\", \"jittered\", not \"center\""));
    CHECK(message_with("/frames", json::array()) == Contains("frames must be a list of at least one frame"));
    CHECK(message_with("/frames", {{"a", 1}}) == Contains("frames must be a list, not an object"));
    CHECK(message_with("/frames/1", 7) == Contains("frames[1] must be an object, not 7"));
    CHECK(message_with("/frames/1/color", 7) == Contains("frames[1].color must be a string, not 7"));
    CHECK(message_with("/frames/1/reset", "yes") == Contains("frames[1].reset must be true or false"));
    CHECK(message_with("/frames/1/exposure", 0) == Contains("frames[1].exposure must be a positive number, not 0"));
    CHECK(message_with("/frames/1/exposure", 1e-300) == Contains("frames[1].exposure must be a positive number"));
    CHECK(message_with("/frames/1/exposure", 1e300) == Contains("frames[1].exposure must be a positive number"));
    CHECK(message_with("/frames/2/jitter", {0}) == Contains("frames[2].jitter must be a list of 2, not a list of 1"));
    CHECK(message_with("/frames/2/jitter/1", 1.01) == Contains("frames[2].jitter[1] must be a number from -1 to 1"));
    CHECK(message_with("/frames/2/jitter/0", -1.01) == Contains("frames[2].jitter[0] must be"));
    CHECK(message_with("/frames/2/jitter/0", nullptr) == Contains("frames[2].jitter[0] must be a number"));
    CHECK(message_with("/frames/2/jitter", {1, -1}) == "no error");
    CHECK(message_with("/frames/0/camera", {{"view", 1}}) == Contains("frames[0].camera.view must be a list of 4"));
}

TEST_CASE("files outside the sequence's folder are refused, however they are named") {
    for (const char* path : {"../secret.png", "color/../../secret.png", "/etc/passwd", "", ".."})
        CHECK(message_with("/frames/1/color", path) == Contains("frames[1].color must be a path"));
    CHECK(message_with("/frames/1/ui", "../ui.png") == Contains("frames[1].ui must be a path inside"));
    CHECK(message_with("/frames/1/color", std::string("color\0.png", 10)) ==
          Contains("frames[1].color must be a path"));
    CHECK(message_with("/frames/1/color", std::string(10'000, 'x')) == Contains("frames[1].color must be a path"));
    CHECK(message_with("/frames/1/color", "color/../other/0001.png") == "no error");

    const Description file(description().dump());
    const TemporaryFolder elsewhere;
    std::filesystem::create_directory_symlink(elsewhere.path(), file.folder() / "depth");
    const std::string outside = (std::filesystem::canonical(elsewhere.path()) / "0000.exr").string();
    CHECK_THROWS_WITH_AS(file.read(),
                         Contains(("frames[0].depth must be a path inside the sequence's folder, not "
                                   "\"depth/0000.exr\", which a link leads out to " +
                                   outside)
                                      .c_str()),
                         Error);
    CHECK(message_with("/frames/1/color", "../secret.png") != Contains("link"));
    std::filesystem::remove(file.folder() / "depth");
    std::filesystem::create_directory(file.folder() / "elsewhere in it");
    std::filesystem::create_directory_symlink("elsewhere in it", file.folder() / "depth");
    CHECK(file.read().frames.size() == 3);
    std::filesystem::create_directory_symlink("color", file.folder() / "color");  // leads to itself
    CHECK_THROWS_WITH_AS(file.read(), Contains("frames[0].color"), Error);
}

TEST_CASE("a sequence may say what its output size is") {
    json text = description();
    text["output_size"] = {1920, 810};
    const Sequence sequence = Description(text.dump()).read();
    CHECK(sequence.output_size() == Size{1920, 810});
    CHECK(sequence.scale == 2);
    CHECK(sequence.output_scale() == doctest::Approx(std::sqrt(2 * 1.5)));
    CHECK(Description(description().dump()).read().output_scale() == 2);
    CHECK(message_with("/output_size", 1920) == Contains("output_size must be a list of 2, not 1920"));
    CHECK(message_with("/output_size", {1920, 0}) == Contains("output_size[1] must be a whole number from 1"));
}

TEST_CASE("a frame may have been rendered smaller than the sequence says") {
    json text = description();
    text["frames"][1]["render_size"] = {480, 405};
    const Sequence sequence = Description(text.dump()).read();
    CHECK(sequence.is_dynamic());
    CHECK(sequence.render_size_of(sequence.frames[0]) == Size{960, 540});
    CHECK(sequence.render_size_of(sequence.frames[1]) == Size{480, 405});
    CHECK(sequence.output_size() == Size{1920, 1080});
    // uv, from the previous frame, y up.
    CHECK(sequence.motion_scale(sequence.frames[0]) == Vec2{-960, 540});
    CHECK(sequence.motion_scale(sequence.frames[1]) == Vec2{-480, 405});
    CHECK(sequence.motion_encoding().scale == Vec2{-960, 540});
    CHECK_FALSE(Description(description().dump()).read().is_dynamic());
    CHECK(message_with("/frames/1/render_size", {961, 540}) ==
          Contains("frames[1].render_size must be at most the sequence's render_size, 960x540"));
    CHECK(message_with("/frames/1/render_size", {0, 540}) ==
          Contains("frames[1].render_size[0] must be a whole number"));
    CHECK(message_with("/frames/1/render_size", 2) == Contains("frames[1].render_size must be a list of 2"));
}

TEST_CASE("a sequence that is written reads as it was") {
    json text = description();
    text["frames"][2]["render_size"] = {480, 270};
    text["output_size"] = {1440, 900};
    text["color_space"] = "linear";
    text["depth"] = {{"encoding", "projective"}, {"reversed", true}, {"near", 0.1}, {"far", nullptr}};
    text["depth"]["channels"] = {"View.Depth.Z"};
    text["motion"]["channels"] = {"u", "v"};
    text["motion"]["part"] = "velocity";
    text["color"] = {{"part", "beauty"}, {"channels", {"R", "G", "B", "A"}}};
    text["frames"][1]["exposure"] = 0.3;
    text["frames"][1]["reset"] = true;
    text["frames"][1]["jitter"] = {-1.0 / 6, 1.0 / 3};
    text["frames"][2]["reactive"] = "masks/0002.png";
    const json matrix = {{1, 2, 3, 4}, {5, 6, 7, 8}, {9, 10, 11, 12}, {13, 14, 15, 16.5}};
    text["frames"][2]["camera"] = {
        {"view", matrix}, {"projection", matrix}, {"near", 0.1}, {"far", nullptr}, {"fov_y", 1}};
    const Description file(text.dump());
    const Sequence before = file.read();
    CHECK(before.frames[2].camera->view[15] == 16.5f);
    std::filesystem::remove(file.folder() / "sequence.json");
    write_sequence(before, file.folder());
    const Sequence after = file.read();

    CHECK(after.render_size == before.render_size);
    CHECK(after.scale == before.scale);
    CHECK(after.output_size() == Size{1440, 900});
    CHECK(after.frame_rate == before.frame_rate);
    CHECK(after.color_space == before.color_space);
    CHECK(after.depth.projective);
    CHECK(after.depth.reversed);
    CHECK(after.color_channels == ChannelNames{"beauty", {"R", "G", "B", "A"}});
    CHECK(after.depth_channels == ChannelNames{"", {"View.Depth.Z"}});
    CHECK(after.motion_channels == ChannelNames{"velocity", {"u", "v"}});
    CHECK(after.motion_encoding().scale == before.motion_encoding().scale);
    CHECK(after.motion.jittered);
    CHECK(after.motion.sampled_at_jitter);
    REQUIRE(after.frames.size() == 3);
    for (size_t i = 0; i < 3; ++i) {
        CHECK(after.frames[i].color == before.frames[i].color);
        CHECK(after.frames[i].depth == before.frames[i].depth);
        CHECK(after.frames[i].motion == before.frames[i].motion);
        CHECK(after.frames[i].reference == before.frames[i].reference);
        CHECK(after.frames[i].optional == before.frames[i].optional);
        CHECK(after.frames[i].jitter == before.frames[i].jitter);
        CHECK(after.frames[i].exposure == before.frames[i].exposure);
        CHECK(after.frames[i].reset == before.frames[i].reset);
        CHECK(after.frames[i].near_plane == before.frames[i].near_plane);
        CHECK(after.frames[i].far_plane == before.frames[i].far_plane);
        CHECK(after.frames[i].camera.has_value() == before.frames[i].camera.has_value());
    }
    CHECK(after.frames[2].camera->projection == before.frames[2].camera->projection);
    CHECK(after.frames[2].camera->far_plane == std::numeric_limits<float>::infinity());
    CHECK(read_file(file.folder() / "sequence.json").find("-0.16666667") != std::string::npos);
    for (const auto& entry : std::filesystem::directory_iterator(file.folder()))
        CHECK_MESSAGE(entry.path().extension() != ".partial", entry.path());
}

TEST_CASE("what the native layout cannot say is not written") {
    const Description file(description().dump());
    Sequence sequence = file.read();
    const TemporaryFolder elsewhere;
    CHECK_THROWS_WITH_AS(write_sequence(sequence, elsewhere.path()), Contains("is outside"), Error);
    sequence.depth_storage = DepthStorage::packed_rgba8;
    CHECK_THROWS_AS(write_sequence(sequence, file.folder()), Error);
    sequence.depth_storage = DepthStorage::first_channel;
    sequence.depth.projective = true;
    sequence.frames[1].near_plane = 1;
    CHECK_THROWS_AS(write_sequence(sequence, file.folder()), Error);
    CHECK_FALSE(std::filesystem::exists(elsewhere / "sequence.json"));
}

TEST_CASE("damaged anywhere, a description is read or refused") {
    const std::string whole = description().dump();
    std::mt19937 random(1);
    int refused = 0;
    for (int round = 0; round < 3000; ++round) {
        std::string damaged = whole;
        for (int flips = 1 + round % 3; flips > 0; --flips)
            damaged[random() % damaged.size()] ^= static_cast<char>(1 << random() % 8);
        try {
            const Sequence sequence = Description(damaged).read();
            CHECK(sequence.frames.size() == 3);
        } catch (const Error&) {
            ++refused;
        }
    }
    CHECK(refused > 1000);
}
