#include <doctest/doctest.h>
#include <sys/stat.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "io/file.h"
#include "noise_sequence.h"
#include "run_clarus.h"
#include "temporary_folder.h"
#include "test_device.h"

// What commands refuse to write, and what becomes of them where nothing can be written.

using namespace clarus;
using namespace clarus::test;
namespace fs = std::filesystem;

namespace {

bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

void write(const fs::path& file, const std::string& text) {
    fs::create_directories(file.parent_path());
    std::ofstream(file) << text;
}

/// A sequence, pictures of it, and what else commands read.
struct Workplace {
    TemporaryFolder folder;
    const fs::path sequence = folder / "sequence", pictures = folder / "pictures", model = folder / "model.safetensors",
                   scene = folder / "cards.obj", checks = folder / "checks.json";

    Workplace() {
        write_noise_sequence(sequence, {12, 8}, 2, ColorSpace::srgb);
        REQUIRE(
            run_clarus({"upscale", sequence, "--model", "bicubic", "--device", test_selector(), "-o", pictures}).code ==
            0);
        fs::copy_file(CLARUS_GOLDEN_DIR "/enss_x2_table.model.safetensors", model);
        write(scene, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
        write(checks, "[]");
    }
};

}  // namespace

TEST_CASE("no command replaces what it reads") {
    const Workplace place;
    const fs::path reference = place.sequence / "reference/0001.png", color = place.sequence / "color/0001.png",
                   picture = place.pictures / "0001.png", description = place.sequence / "sequence.json",
                   part = place.folder / "bench.json.part";  // what is measured until it is done
    write(part, "[]");
    const std::vector<std::pair<fs::path, std::vector<std::string>>> commands{
        {reference, {"compare", place.pictures, place.sequence, "--sheet", reference}},
        {color, {"compare", place.pictures, place.sequence, "--sheet", color}},
        {picture, {"compare", place.pictures, place.sequence, "--sheet", picture}},
        {picture, {"compare", place.sequence / "reference", place.pictures, "--sheet", picture}},
        {place.model, {"bench", "--models", place.model, "-o", place.model}},
        {place.checks, {"bench", "--models", "bicubic", "--checks", place.checks, "-o", place.checks}},
        {place.model,
         {"bench", "placement", "--devices", test_selector(), "--streams", "2", "--model", place.model, "-o",
          place.model}},
        {place.model, {"model", place.model, "-o", place.model}},
        {place.model,
         {"serve", "refused", "--model", place.model, "--device", test_selector(), "--trace", place.model}},
        {description, {"play", place.sequence, "--share", "refused", "--trace", description}},
        {place.scene, {"render", "--scene", place.scene, "--share", "refused", "--trace", place.scene}},
        {color, {"report", place.pictures, "--sequence", place.sequence, "-o", color}},
        {color, {"check", place.sequence, "--report", color}},
        {place.model, {"quantize", place.model, place.sequence, "-o", place.model}},
        {part, {"bench", "--models", "bicubic", "--checks", part, "-o", place.folder / "bench.json"}},
    };
    for (const auto& [file, words] : commands) {
        CAPTURE(words.front());
        CAPTURE(file.string());
        const std::string before = io::read_file(file);
        const Outcome outcome = run_clarus(words);
        CHECK(outcome.code == 1);
        const bool says_so = contains(outcome.errors, "would replace") || contains(outcome.errors, "would lie among");
        CHECK_MESSAGE(says_so, outcome.errors);
        CHECK(io::read_file(file) == before);
    }
}

TEST_CASE("what is no regular file is no output, which is said before the work") {
    const Workplace place;
    const fs::path pipe = place.folder / "pipe";
    REQUIRE(mkfifo(pipe.c_str(), 0600) == 0);
    for (const char* option : {"--report", "--trace"}) {
        const Outcome outcome = run_clarus({"upscale", place.sequence, "--model", "bicubic", "--device",
                                            test_selector(), "-o", place.folder / "other", option, pipe});
        CHECK(outcome.code == 1);
        CHECK_MESSAGE(contains(outcome.errors, "that is no regular file"), outcome.errors);
        CHECK_FALSE(fs::exists(place.folder / "other"));
    }
    const fs::path video = place.folder / "pipe.mp4";
    REQUIRE(mkfifo(video.c_str(), 0600) == 0);
    const Outcome outcome = run_clarus({"upscale", video, "--model", "bicubic", "-o", place.folder / "other"});
    CHECK(outcome.code == 1);
    CHECK_MESSAGE(contains(outcome.errors, "not a file"), outcome.errors);
}

TEST_CASE("render leaves alone what is no sequence's") {
    const TemporaryFolder folder;
    const auto render = [&](const fs::path& into, std::vector<std::string> more) {
        for (const char* word :
             {"render", "--scene", "demo", "--size", "16x12", "--frames", "2", "--no-reference", "-o"})
            more.emplace_back(word);
        more.push_back(into);
        std::rotate(more.begin(), std::ranges::find(more, "render"), more.end());
        return run_clarus(more);
    };
    write(folder / "mine/color/2024.txt", "a year");
    write(folder / "mine/depth/7.dat", "seven");
    write(folder / "mine/color/0900.png", "a picture");
    const Outcome beside = render(folder / "mine", {"--force"});
    CHECK_MESSAGE(beside.code == 0, beside.errors);
    CHECK(io::read_file(folder / "mine/color/2024.txt") == "a year");
    CHECK(io::read_file(folder / "mine/depth/7.dat") == "seven");
    CHECK(io::read_file(folder / "mine/color/0900.png") == "a picture");

    for (const std::string name : {"0000", "0001"}) {  // the first frame's is seen at once, others when they are due
        const fs::path other = folder / ("of" + name);
        write(other / "color" / (name + ".png"), "a picture");
        for (const std::vector<std::string>& more : {std::vector<std::string>{}, {"--force"}}) {
            const Outcome outcome = render(other, more);
            if (name == "0001" && !more.empty()) break;  // of the unfinished sequence that is there by now
            CHECK(outcome.code == 1);
            CHECK_MESSAGE(contains(outcome.errors, name + ".png is there already, and of no sequence"), outcome.errors);
            CHECK(io::read_file(other / "color" / (name + ".png")) == "a picture");
        }
    }

    fs::create_directories(folder / "elsewhere");
    fs::create_directories(folder / "linked");
    fs::create_symlink(folder / "elsewhere", folder / "linked/color");
    const Outcome linked = render(folder / "linked", {});
    CHECK(linked.code == 1);
    CHECK_MESSAGE(contains(linked.errors, "color is a link"), linked.errors);
    CHECK(fs::is_empty(folder / "elsewhere"));
}

TEST_CASE("where nothing can be said, the exit status says it") {
    const auto status_of = [](const std::string& line) {
        const int status = std::system(("'" CLARUS_TOOL "' " + line).c_str());
        return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
    };
    CHECK(status_of("model nonsense 2>&-") == 1);
    CHECK(status_of("model nonsense 2>/dev/full") == 1);
    CHECK(status_of("models >/dev/full 2>/dev/full") == 1);
    CHECK(status_of("upscale 2>/dev/full") == 2);
    CHECK(status_of("2>/dev/full") == 2);
}

TEST_CASE("a file that grows beyond what is allowed is an error, and leaves nothing") {
    const Workplace place;
    const fs::path out = place.folder / "out";
    fs::create_directories(out);
    const std::string line = "ulimit -f 3; exec '" CLARUS_TOOL "' report '" + place.pictures.string() +
                             "' --sequence '" + place.sequence.string() + "' -o '" + (out / "page.html").string() + "'";
    Program shell("/bin/bash", {"-c", line});
    CHECK(shell.result() == 1);
    CHECK_MESSAGE(contains(shell.errors(), "File too large"), shell.errors());
    CHECK(fs::is_empty(out));
}

TEST_CASE("names that are not UTF-8 lose no result") {
    const Workplace place;
    const fs::path odd = place.folder / "odd\xff";
    fs::rename(place.pictures, odd);
    const Outcome compared = run_clarus({"compare", odd, place.sequence, "--json"});
    CHECK_MESSAGE(compared.code == 0, compared.errors);
    CHECK(contains(compared.out, "odd\xef\xbf\xbd"));
    const Outcome upscaled = run_clarus({"upscale", place.sequence, "--model", "bicubic", "--device", test_selector(),
                                         "-o", odd, "--report", odd / "report.json"});
    CHECK_MESSAGE(upscaled.code == 0, upscaled.errors);
    CHECK(fs::exists(odd / "report.json"));
}

TEST_CASE("a picture that is damaged is not counted as done without a word") {
    const Workplace place;
    const fs::path out = place.folder / "out";
    const auto upscale = [&](const std::vector<std::string>& more) {
        std::vector<std::string> words{"upscale",  place.sequence,  "--model", "bicubic",
                                       "--device", test_selector(), "-o",      out};
        words.insert(words.end(), more.begin(), more.end());
        return run_clarus(words);
    };
    REQUIRE(upscale({"--frames", ":1"}).code == 0);
    fs::resize_file(out / "0000.png", 0);
    const Outcome resumed = upscale({"--resume"});
    CHECK(resumed.code == 0);
    CHECK_MESSAGE(contains(resumed.errors, "1 of the pictures before"), resumed.errors);
}

TEST_CASE("pictures of --view do not replace the sequence's") {
    const Workplace place;
    const fs::path out = place.folder / "out", views = out / "views/input_color";
    fs::create_directories(out / "views");
    const std::string before = io::read_file(place.sequence / "color/0000.png");
    const auto upscale = [&](const fs::path& sequence) {
        return run_clarus({"upscale", sequence, "--model", CLARUS_MODEL_DIR "/stack/weights/espcn-x2.safetensors",
                           "--device", test_selector(), "-o", out, "--view", "input_color"});
    };
    const auto check_refused = [&](const Outcome& outcome) {
        CHECK(outcome.code == 1);
        CHECK_MESSAGE(contains(outcome.errors, "--view input_color"), outcome.errors);
        CHECK(io::read_file(place.sequence / "color/0000.png") == before);
    };
    fs::create_directory_symlink(place.sequence / "color", views);
    check_refused(upscale(place.sequence));
    fs::remove(views);
    fs::copy(place.sequence / "color", views);
    check_refused(upscale(views));
}

TEST_CASE("bench replaces an unfinished result by none but its own") {
    const Workplace place;
    const fs::path part = place.folder / "bench.json.part";
    write(part, "a letter");
    const Outcome outcome = run_clarus({"bench", "--models", "bicubic", "-o", place.folder / "bench.json"});
    CHECK(outcome.code == 1);
    CHECK_MESSAGE(contains(outcome.errors, "bench.json.part is not valid JSON"), outcome.errors);
    CHECK(io::read_file(part) == "a letter");
}

TEST_CASE("a file that claims to be long takes no memory") {
    const Workplace place;
    constexpr uintmax_t long_size = uintmax_t{1} << 40;  // without contents
    const auto check_refused = [&](const fs::path& file, const std::vector<std::string>& words) {
        fs::resize_file(file, long_size);
        const Outcome outcome = run_clarus(words);
        CHECK(outcome.code == 1);
        CHECK_MESSAGE(contains(outcome.errors, file.string()), outcome.errors);
        CHECK_FALSE(contains(outcome.errors, "memory"));
    };
    check_refused(place.model, {"model", place.model});
    check_refused(place.checks, {"bench", "--models", "bicubic", "--checks", place.checks, "-o", place.folder / "b"});
    const fs::path report = place.pictures / "report.json";
    write(report, "{}");
    check_refused(report, {"compare", place.pictures, place.sequence});
}

TEST_CASE("what lies in the working folder is no Python module") {
    const Workplace place;
    for (const char* module : {"numpy", "json"})
        write(place.folder / (module + std::string(".py")), "open('ran', 'w')");
    for (const char* metric : {"--flip", "--vmaf"}) {
        Program shell("/bin/sh", {"-c", "cd '" + (place.folder / "").string() +
                                            "' && exec '" CLARUS_TOOL "' compare pictures "
                                            "sequence " +
                                            metric});
        shell.result();  // whether this machine has what the metric needs or not
        CHECK_FALSE(fs::exists(place.folder / "ran"));
    }
}

TEST_CASE("numbers that are none are refused") {
    const Workplace place;
    for (const std::vector<std::string>& words :
         {std::vector<std::string>{"bench", "--seconds", "nan"},
          {"quantize", place.model, place.sequence, "-o", place.folder / "q.safetensors", "--percentile", "nan"},
          {"upscale", place.sequence, "--model", "bicubic", "-o", place.folder / "out", "--save-every", "nan"}}) {
        const Outcome outcome = run_clarus(words);
        CHECK(outcome.code == 2);
        CHECK_MESSAGE(contains(outcome.errors, "not a finite number"), outcome.errors);
    }
}
