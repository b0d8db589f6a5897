#include <doctest/doctest.h>
#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <fstream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "io/file.h"
#include "io/image.h"
#include "noise_sequence.h"
#include "program.h"
#include "run_clarus.h"
#include "test_device.h"

// `clarus upscale --resume` as a process: what a run leaves when it ends before its sequence does, however it ends.

using namespace clarus;
using namespace clarus::test;
namespace fs = std::filesystem;
using nlohmann::json;

namespace {

constexpr int kFrames = 6;
const Size kRender{24, 16};
const std::string kNetwork = CLARUS_GOLDEN_DIR "/enss_x2_table.model.safetensors";
const std::string kState = ".clarus-run.safetensors";

bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

using Files = std::map<std::string, std::string>;  // bytes by name within the folder

/// A sequence with a cut, jitter, a mask from its middle on, and a place for results.
class Workplace {
  public:
    explicit Workplace(int frames = kFrames) {
        write_noise_sequence(sequence(), kRender, frames);
        json changed = description();
        fs::create_directory(sequence() / "reactive");
        for (int i = 0; i < frames; ++i) {
            json& frame = changed["frames"][i];
            frame["jitter"] = {i % 2 == 0 ? 0.25 : -0.25, i % 3 == 0 ? 0.25 : -0.25};
            frame["reset"] = i % 4 == 0;
            if (i < frames / 2) continue;
            frame["reactive"] = fmt::format("reactive/{:04}.png", i);
            io::write_image(sequence() / frame["reactive"], noise(kRender, 1, 0, 1, 100 + i), io::SampleType::u8);
        }
        describe(changed);
    }

    fs::path sequence() const { return folder_ / "sequence"; }
    fs::path operator/(const fs::path& name) const { return folder_ / name; }
    json description() const { return json::parse(io::read_file(sequence() / "sequence.json")); }
    void describe(const json& description) const { write("sequence/sequence.json", description.dump()); }
    void write(const fs::path& name, const std::string& bytes) const {
        std::ofstream(folder_ / name, std::ios::binary) << bytes;
    }

    std::vector<std::string> arguments(const std::string& output, const std::string& model,
                                       const std::vector<std::string>& more) const {
        std::vector<std::string> all{"upscale",  sequence(),       "--model",  model,   "--device",  test_selector(),
                                     "--output", folder_ / output, "--tuning", "fixed", "--no-check"};
        all.insert(all.end(), more.begin(), more.end());
        return all;
    }
    Outcome upscale(const std::string& output, const std::string& model,
                    const std::vector<std::string>& more = {}) const {
        return run_clarus(arguments(output, model, more));
    }

    Files files(const std::string& output) const {
        Files all;
        if (!fs::is_directory(folder_ / output)) return all;
        for (const auto& entry : fs::recursive_directory_iterator(folder_ / output))
            if (entry.is_regular_file())
                all[entry.path().lexically_relative(folder_ / output)] = io::read_file(entry.path());
        return all;
    }
    /// Pictures under their final names. Unlike `files`, it may be called while a run writes and renames.
    int pictures(const std::string& output) const {
        int made = 0;
        while (fs::exists(folder_ / output / fmt::format("{:04}.png", made))) ++made;
        return made;
    }

  private:
    TemporaryFolder folder_;
};

void check_same(const Files& files, const Files& expected) {
    CHECK(files.size() == expected.size());
    for (const auto& [name, bytes] : expected) {
        CAPTURE(name);
        REQUIRE(files.contains(name));
        CHECK(files.at(name) == bytes);
    }
}

void check_refused(const Workplace& place, const std::vector<std::string>& why,
                   const std::vector<std::string>& more = {}, const std::string& model = kNetwork) {
    const Files before = place.files("part");
    std::vector<std::string> options{"--resume"};
    options.insert(options.end(), more.begin(), more.end());
    const Outcome outcome = place.upscale("part", model, options);
    CHECK(outcome.code == 1);
    for (const std::string& words : why) CHECK_MESSAGE(contains(outcome.errors, words), outcome.errors);
    CHECK(place.files("part") == before);
}

}  // namespace

TEST_CASE("a run that is gone on with leaves the bytes of one run") {
    using Words = std::vector<std::string>;
    struct Case {
        std::string model;
        Words options;
    };
    const std::string golden = CLARUS_GOLDEN_DIR "/";
    for (const auto& [model, options] :
         {Case{kNetwork, {}}, Case{kNetwork, {"--precision", "fp16", "--format", "exr", "--view", "alpha"}},
          Case{kNetwork, {"--frame-rate", "x2"}}, Case{golden + "mnss_x2_checked.model.safetensors", {}},
          Case{golden + "nsrr_x2_checked.model.safetensors", {"--sharpen"}},
          Case{golden + "nss_x2.model.safetensors", {}}, Case{"fsr2", {"--output-size", "60x40"}},
          Case{"bicubic", {"--antialias", "mlaa"}}}) {
        CAPTURE(model);
        CAPTURE(options);
        const Workplace place;
        const auto upscale = [&](const std::string& output, Words more) {
            more.insert(more.end(), options.begin(), options.end());
            const Outcome outcome = place.upscale(output, model, more);
            REQUIRE_MESSAGE(outcome.code == 0, outcome.errors);
            return outcome.out;
        };
        upscale("whole", {});
        const Files expected = place.files("whole");
        CHECK_FALSE(expected.contains(kState));

        CHECK(contains(upscale("part", {"--frames", "0:2"}), "--resume goes on there"));
        CHECK(place.files("part").contains(kState));
        CHECK(contains(upscale("part", {"--resume", "--frames", "2:3"}), "going on at frame 2 of 6"));
        CHECK(contains(upscale("part", {"--resume", "--frames", "0:3"}), "nothing is left to make"));
        upscale("part", {"--resume"});
        check_same(place.files("part"), expected);
    }
}

TEST_CASE("colours' alpha and their bits are those of one run") {
    const Workplace place;
    for (int i = 0; i < kFrames; ++i)  // 8 bits, then 16; without alpha, then with it
        io::write_image(place.sequence() / fmt::format("color/{:04}.png", i), noise(kRender, i < 2 ? 3 : 4, 0, 1, i),
                        i < 3 ? io::SampleType::u8 : io::SampleType::u16);
    REQUIRE(place.upscale("whole", kNetwork).code == 0);
    REQUIRE(place.upscale("part", kNetwork, {"--frames", ":3"}).code == 0);
    check_refused(place, {"--bits was 8 and is 16"}, {"--bits", "16"});
    check_refused(place, {"--alpha was keep and is drop"}, {"--alpha", "drop"});
    const Outcome outcome = place.upscale("part", kNetwork, {"--resume"});
    REQUIRE_MESSAGE(outcome.code == 0, outcome.errors);
    check_same(place.files("part"), place.files("whole"));
}

TEST_CASE("resolution that changes goes on as in one run") {
    const Workplace place;
    const Size smaller{20, 14};
    json changed = place.description();
    for (const int i : {2, 3, 5}) {
        json& frame = changed["frames"][i];
        frame["render_size"] = {smaller.width, smaller.height};
        frame.erase("reactive");
        const auto write = [&](const char* kind, int channels, io::SampleType type) {
            io::write_image(place.sequence() / frame[kind], noise(smaller, channels, 0, 1, 200 + i), type);
        };
        write("color", 3, io::SampleType::u8);
        write("depth", 1, io::SampleType::f32);
        write("motion", 2, io::SampleType::f32);
    }
    place.describe(changed);
    REQUIRE(place.upscale("whole", kNetwork).code == 0);
    for (const std::string end : {":1", ":2", ":3", ":4", ":5", ":6"}) {
        const Outcome outcome = place.upscale("part", kNetwork, {"--resume", "--frames", end});
        REQUIRE_MESSAGE(outcome.code == 0, outcome.errors);
    }
    check_same(place.files("part"), place.files("whole"));
}

namespace {

using Clock = std::chrono::steady_clock;

/// A run that is started again and again, and killed after some time.
struct Killed {
    std::string output;
    std::unique_ptr<Program> program;
    fs::file_time_type before;               // when its state was last written
    std::optional<Clock::time_point> until;  // none before this one has written it
};

fs::file_time_type last_written(const fs::path& file) {
    std::error_code none;
    const fs::file_time_type time = fs::last_write_time(file, none);
    return none ? fs::file_time_type() : time;
}

}  // namespace

TEST_CASE("a run that is killed, at any instant, a hundred times, and gone on with leaves the bytes of one run") {
    constexpr int kKills = 100, kLong = 12;
    const Workplace place(kLong);
    REQUIRE(place.upscale("whole", kNetwork).code == 0);
    const Files expected = place.files("whole");
    const auto made = [&](const std::string& output) {
        Files files = place.files(output);
        std::erase_if(files, [](const auto& file) {  // what it was about to write
            return file.first.starts_with(".clarus-") && file.first != kState;
        });
        return files;
    };

    std::mt19937 random(1);
    const auto after = [&](int most_milliseconds) {
        return Clock::now() + std::chrono::microseconds(random() % (1000 * most_milliseconds));
    };
    int starts = 0, kills = 0, ends = 0;
    const auto begin = [&](Killed& run) {
        run.before = last_written(place / run.output / kState);
        run.program = std::make_unique<Program>(
            CLARUS_TOOL, place.arguments(run.output, kNetwork, {"--resume", "--save-every", "0"}));
        // Every third while it starts; the others while pictures and states are written.
        run.until.reset();
        if (starts++ % 3 == 0) run.until = after(900);
    };
    std::array<Killed, 2> runs;
    runs[0].output = "one";
    runs[1].output = "other";
    for (Killed& run : runs) begin(run);
    const Clock::time_point give_up = Clock::now() + std::chrono::minutes(10);
    while (kills < kKills) {
        REQUIRE(Clock::now() < give_up);
        std::this_thread::sleep_for(std::chrono::milliseconds(3));
        for (Killed& run : runs) {
            if (!run.until && last_written(place / run.output / kState) != run.before) run.until = after(60);
            if (!run.until || Clock::now() < *run.until) continue;
            const bool is_killed = run.program->kill_unless_ended();
            kills += is_killed;
            if (!is_killed) REQUIRE_MESSAGE(run.program->result() == 0, run.program->errors());
            if (const Files files = made(run.output); files.size() == kLong && !files.contains(kState)) {
                check_same(files, expected);
                fs::remove_all(place / run.output);
                ++ends;
            }
            begin(run);
        }
    }
    for (Killed& run : runs) {
        run.program.reset();
        const Outcome outcome = place.upscale(run.output, kNetwork, {"--resume"});
        REQUIRE_MESSAGE(outcome.code == 0, outcome.errors);
        check_same(made(run.output), expected);
    }
    MESSAGE(fmt::format("{} kills, {} runs made their last frame", kills, ends));
    CHECK(ends > 2);
}

TEST_CASE("Ctrl-C and a frame that cannot be read leave a state to go on from") {
    const Workplace place(60);
    REQUIRE(place.upscale("whole", kNetwork).code == 0);
    Program program(CLARUS_TOOL, place.arguments("part", kNetwork, {}));
    for (int i = 0; i < 6000 && place.pictures("part") < 3; ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
    program.interrupt();
    CHECK(program.result() == 1);
    CHECK_MESSAGE(contains(program.errors(), "--resume goes on"), program.errors());
    const int made = place.pictures("part");
    CHECK(made < 60);
    CHECK(place.files("part").size() == made + 1u);

    const fs::path damaged = place.sequence() / "color/0055.png";
    const std::string sound = io::read_file(damaged);
    place.write(damaged, sound.substr(0, sound.size() * 2 / 3));
    const Outcome stopped = place.upscale("part", kNetwork, {"--resume"});
    CHECK(stopped.code == 1);
    CHECK_MESSAGE(contains(stopped.errors, "0055.png"), stopped.errors);
    CHECK_MESSAGE(contains(stopped.out, fmt::format("going on at frame {} of 60", made)), stopped.out);
    CHECK(place.files("part").size() == 55 + 1);

    place.write(damaged, sound);
    const Outcome outcome = place.upscale("part", kNetwork, {"--resume"});
    REQUIRE_MESSAGE(outcome.code == 0, outcome.errors);
    CHECK_MESSAGE(contains(outcome.out, "going on at frame 55 of 60"), outcome.out);
    check_same(place.files("part"), place.files("whole"));
}

TEST_CASE("a state of another run is refused with what differs and the way out") {
    const Workplace place;
    REQUIRE(place.upscale("part", kNetwork, {"--frames", "1:3"}).code == 0);
    const std::string out = "leave --resume out to start over";
    check_refused(place, {"--model was enss_x2_table.model and is fsr2", out}, {}, "fsr2");
    check_refused(place, {"--precision was fp32 and is fp16", "--sharpen was 0 and is 0.15", out},
                  {"--precision", "fp16", "--sharpen"});
    check_refused(place, {"--view was none and is alpha", out}, {"--view", "alpha"});
    check_refused(place, {"the output size was 48x32 and is 60x40", out}, {"--output-size", "60x40"});
    check_refused(place, {"--format was png and is exr", out}, {"--format", "exr"});
    check_refused(place, {"--frames 4: does not follow", "from 1 to 3", out}, {"--frames", "4:"});
    check_refused(place, {"--frames 0: does not follow", out}, {"--frames", "0:5"});

    const json description = place.description();
    json changed = description;
    changed["frames"][2]["jitter"] = {0.125, 0.125};
    place.describe(changed);
    check_refused(place, {"another sequence", out});
    changed["frames"].erase(2);
    changed["frames"].erase(2);
    changed["frames"].erase(2);
    changed["frames"].erase(2);
    place.describe(changed);
    check_refused(place, {"another sequence", out});
    changed = description;
    changed["frames"].push_back(changed["frames"][0]);  // it may grow
    changed["frames"].back()["color"] = "color/0006.png";
    fs::copy_file(place.sequence() / "color/0000.png", place.sequence() / "color/0006.png");
    place.describe(changed);
    CHECK(place.upscale("part", kNetwork, {"--resume", "--frames", "3:4"}).code == 0);

    const fs::path color = place.sequence() / "color/0003.png";
    io::write_image(color, noise(kRender, 3, 0, 1, 77), io::SampleType::u8);
    check_refused(place, {"another sequence", out});
}

TEST_CASE("the same name of another model is no way past its weights") {
    const Workplace place;
    const fs::path model = place / "model.safetensors";
    fs::copy_file(kNetwork, model);
    REQUIRE(place.upscale("part", model, {"--frames", "1:3"}).code == 0);
    std::string bytes = io::read_file(model);
    bytes.back() = static_cast<char>(bytes.back() ^ 1);
    place.write("model.safetensors", bytes);
    check_refused(place, {kState, "hash", "leave --resume out to start over"}, {}, model);
}

TEST_CASE("a damaged state is refused by name") {
    const Workplace place;
    REQUIRE(place.upscale("part", kNetwork, {"--frames", ":3"}).code == 0);
    const fs::path file = place / "part" / kState;
    const std::string sound = io::read_file(file), out = "leave --resume out to start over";
    std::mt19937 random(2);
    for (int i = 0; i < 8; ++i) {
        std::string bytes = sound;
        char& changed = bytes[i == 0 ? bytes.size() - 1 : random() % bytes.size()];
        changed = static_cast<char>(changed ^ (1 << random() % 8));
        place.write(file, bytes);
        check_refused(place, {kState, out});
    }
    for (const size_t size : {size_t{0}, size_t{9}, sound.size() / 2, sound.size() - 1}) {
        place.write(file, sound.substr(0, size));
        check_refused(place, {kState, out});
    }
    place.write(file, io::read_file(kNetwork));
    check_refused(place, {kState, "form", out});
    fs::remove(file);
    fs::create_directory(file);
    check_refused(place, {kState, out});
    fs::remove(file);
    REQUIRE(mkfifo(file.c_str(), 0600) == 0);
    check_refused(place, {kState, out});

    // Started over, it is as if it had not been there.
    fs::remove(file);
    place.write(file, "nonsense");
    const Outcome over = place.upscale("part", kNetwork);
    REQUIRE_MESSAGE(over.code == 0, over.errors);
    CHECK(contains(over.out, "starting over"));
    CHECK(place.files("part").size() == kFrames);
}

TEST_CASE("without a state a run starts over: nothing says what the pictures were made with") {
    const Workplace place;
    for (const std::string& model : {std::string("bicubic"), kNetwork}) {
        CAPTURE(model);
        REQUIRE(place.upscale("whole", model).code == 0);
        const Files expected = place.files("whole");
        fs::remove_all(place / "part");
        const Outcome first = place.upscale("part", model, {"--resume"});  // of nothing
        REQUIRE_MESSAGE(first.code == 0, first.errors);
        check_same(place.files("part"), expected);

        fs::remove(place / "part/0003.png");
        const Outcome outcome = place.upscale("part", model, {"--resume"});
        REQUIRE_MESSAGE(outcome.code == 0, outcome.errors);
        CHECK_MESSAGE(contains(outcome.out, "starting over at frame 0: 3 frames are there"), outcome.out);
        check_same(place.files("part"), expected);
        const Outcome other = place.upscale("part", "nearest", {"--resume"});
        CHECK_MESSAGE(contains(other.out, "starting over at frame 0: 6 frames are there"), other.out);
    }
}

TEST_CASE("frames that are gone are told, and a run that starts over has no state of the one before") {
    const Workplace place;
    REQUIRE(place.upscale("part", kNetwork, {"--frames", ":3"}).code == 0);
    fs::remove(place / "part/0001.png");
    const Outcome outcome = place.upscale("part", kNetwork, {"--resume", "--frames", ":4"});
    CHECK(outcome.code == 0);
    CHECK_MESSAGE(contains(outcome.errors, "1 of the pictures"), outcome.errors);
    CHECK_MESSAGE(contains(outcome.errors, "0001"), outcome.errors);
    CHECK(contains(place.upscale("part", kNetwork, {"--frames", ":5"}).out, "starting over"));
    CHECK(contains(place.upscale("part", kNetwork, {"--resume"}).out, "going on at frame 5 of 6"));
    CHECK_FALSE(fs::exists(place / "part" / kState));
}

TEST_CASE("a video is not gone on with, and a report does not take the state's place") {
    const Workplace place;
    const Outcome video = place.upscale("video.mp4", kNetwork, {"--resume"});
    CHECK(video.code == 1);
    CHECK_MESSAGE(contains(video.errors, "leave --resume out, or name a folder"), video.errors);
    const Outcome report = place.upscale("part", kNetwork, {"--report", place / "part" / kState});
    CHECK(report.code == 1);
    CHECK_MESSAGE(contains(report.errors, "would replace the run's state"), report.errors);
    CHECK(place.upscale("part", kNetwork, {"--save-every", "-1"}).code == 2);
    CHECK(place.files("part").empty());
}
