#include "check/check.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "io/file.h"
#include "io/frames.h"
#include "noise_sequence.h"
#include "program.h"
#include "temporary_folder.h"
#include "test_device.h"

using namespace clarus;
using check::Film;
using check::Verdict;

namespace {

constexpr size_t pixels = 600;

Film rendered(std::vector<std::string> arguments) {
    const TemporaryFolder folder;
    for (const char* word : {"render", "--size", "160x96", "--frames", "8", "--no-reference", "--threads", "1", "-o"})
        arguments.emplace_back(word);
    arguments.push_back(folder / "sequence");
    std::rotate(arguments.begin(), std::ranges::find(arguments, "render"), arguments.end());
    test::Program program(CLARUS_TOOL, arguments);
    REQUIRE(program.result() == 0);
    return Film::read(io::read_sequence(folder / "sequence"));
}

/// What is made wrong: in what the JSON says, or in what the files hold.
struct Mistake {
    std::string field;  // as Finding::field
    std::string what;   // for the table: the field, and more where a field can be wrong in several ways
    std::function<void(io::Sequence&)> in_json;
    std::function<void(Film&)> in_files;
};

void shift(std::vector<io::Pixels>& images, int by) {
    const std::vector<io::Pixels> before = images;
    for (int i = 0; i < static_cast<int>(images.size()); ++i)
        images[static_cast<size_t>(i)] =
            before[static_cast<size_t>(std::clamp(i + by, 0, static_cast<int>(images.size()) - 1))];
}

void each_jitter(Film& film, const std::function<Vec2(Vec2)>& change) {
    for (io::FrameFiles& frame : film.sequence.frames) frame.jitter = change(frame.jitter);
}

/// In the order in which those of files are made.
std::vector<Mistake> all_mistakes() {
    std::vector<Mistake> mistakes;
    const auto declare = [&](const char* field, const std::function<void(io::Sequence&)>& change) {
        mistakes.push_back({field, field, change, {}});
    };
    const auto store = [&](const char* field, const std::function<void(Film&)>& change, const char* how = "") {
        mistakes.push_back({field, std::string(field) + how, {}, change});
    };
    declare("motion.unit", [](io::Sequence& s) { s.motion.unit = io::MotionUnit::uv; });
    declare("motion.direction", [](io::Sequence& s) { s.motion.from_previous = true; });
    declare("motion.y", [](io::Sequence& s) { s.motion.y_up = true; });
    declare("motion.jittered", [](io::Sequence& s) { s.motion.jittered = true; });
    declare("depth.encoding", [](io::Sequence& s) { s.depth.projective = true; });
    declare("depth.reversed", [](io::Sequence& s) { s.depth.reversed = true; });
    declare("color_space", [](io::Sequence& s) { s.color_space = ColorSpace::linear; });
    store("motion.unit", [](Film& film) {
        for (io::Pixels& image : film.motion)
            for (float& value : image.values) value *= static_cast<float>(film.sequence.scale);
    });
    store("motion axes", [](Film& film) {
        for (io::Pixels& image : film.motion)
            for (size_t i = 0; i < image.values.size(); i += 2) std::swap(image.values[i], image.values[i + 1]);
    });
    store(
        "motion frame", [](Film& film) { shift(film.motion, -1); }, " before");
    store(
        "motion frame", [](Film& film) { shift(film.motion, 1); }, " after");
    store(
        "depth frame", [](Film& film) { shift(film.depth, -1); }, " before");
    store(
        "depth frame", [](Film& film) { shift(film.depth, 1); }, " after");
    store("jitter x", [](Film& film) { each_jitter(film, [](Vec2 j) { return Vec2{-j.x, j.y}; }); });
    store("jitter y", [](Film& film) { each_jitter(film, [](Vec2 j) { return Vec2{j.x, -j.y}; }); });
    store("jitter axes", [](Film& film) { each_jitter(film, [](Vec2 j) { return Vec2{j.y, j.x}; }); });
    const auto of_another_frame = [](int by) {
        return [by](Film& film) {
            const std::vector<io::FrameFiles> before = film.sequence.frames;
            for (int i = 0; i < static_cast<int>(before.size()); ++i)
                film.sequence.frames[static_cast<size_t>(i)].jitter =
                    before[static_cast<size_t>(std::clamp(i + by, 0, static_cast<int>(before.size()) - 1))].jitter;
        };
    };
    store("jitter frame", of_another_frame(-1), " before");
    store("jitter frame", of_another_frame(1), " after");
    store("order of frames", [](Film& film) {
        std::swap(film.luma[3], film.luma[4]);
        std::swap(film.motion[3], film.motion[4]);
        std::swap(film.depth[3], film.depth[4]);
        std::swap(film.sequence.frames[3], film.sequence.frames[4]);
    });
    return mistakes;
}

std::set<std::string> wrong_fields(const check::Judgement& judgement) {
    std::set<std::string> fields;
    for (const check::Finding& one : judgement.findings)
        if (one.verdict == Verdict::wrong) fields.insert(one.field);
    return fields;
}

std::string listed(const std::set<std::string>& fields) {
    std::string text;
    for (const std::string& field : fields) text += (text.empty() ? "" : " + ") + field;
    return text;
}

/// What is found for every single mistake and every pair, where that is not just what was made: by what was made.
std::map<std::string, std::string> surprises(const Film& right, const std::set<std::string>& may_be_missed) {
    const std::vector<Mistake> mistakes = all_mistakes();
    std::map<std::string, std::string> result;
    std::map<std::pair<size_t, size_t>, check::Evidence> measured;  // by the mistakes in files, which alone count
    const size_t none = mistakes.size();
    for (size_t a = 0; a <= none; ++a)
        for (size_t b = a; b <= none; ++b) {  // `a` itself: one mistake; `none`: none at all
            if (b == none && a != none) continue;
            if (a != b && mistakes[a].field == mistakes[b].field) continue;
            Film film = right;
            std::pair files(none, none);
            std::set<std::string> made, what;
            for (const size_t i : std::set{a, b}) {
                if (i == none) continue;
                made.insert(mistakes[i].field);
                what.insert(mistakes[i].what);
                if (!mistakes[i].in_files) continue;
                mistakes[i].in_files(film);
                (files.first == none ? files.first : files.second) = i;
            }
            if (!measured.contains(files)) measured[files] = check::measure(film, pixels);
            io::Sequence declared = film.sequence;
            for (const size_t i : std::set{a, b})
                if (i != none && mistakes[i].in_json) mistakes[i].in_json(declared);
            const std::set<std::string> named = wrong_fields(check::judge(measured[files], declared));
            std::set<std::string> found = named;
            for (std::set<std::string>* fields : {&found, &made})
                std::erase_if(*fields, [&](const std::string& field) { return may_be_missed.contains(field); });
            if (found != made) result[listed(what)] = listed(named);
        }
    return result;
}

/// `may_be_missed`: fields of which the scene says little. `otherwise`: what is named of some pairs, by what was made;
/// `at_a_limit`: of pairs that are on either side of a limit, as processors' mathematics rounds what is rendered.
void check_table(const std::vector<std::string>& scene, const std::set<std::string>& may_be_missed,
                 const std::map<std::string, std::string>& otherwise,
                 const std::map<std::string, std::string>& at_a_limit = {}) {
    std::map<std::string, std::string> found = surprises(rendered(scene), may_be_missed);
    for (const auto& [made, named] : at_a_limit) {
        INFO("made: ", made);
        if (found.contains(made)) CHECK(found[made] == named);
        found.erase(made);
    }
    for (const auto& [made, named] : found) {
        INFO("made: ", made, "; named: ", named);
        const auto known = otherwise.find(made);
        CHECK(known != otherwise.end());
        if (known != otherwise.end()) CHECK(known->second == named);
    }
    for (const auto& [made, named] : otherwise) {
        INFO("made, and not named otherwise any more: ", made);
        CHECK(found.contains(made));
    }
}

bool has_verdict(const check::Judgement& judgement, Verdict verdict) {
    return std::ranges::any_of(judgement.findings, [&](const check::Finding& one) { return one.verdict == verdict; });
}

}  // namespace

TEST_CASE("every mistake and every pair of mistakes is named: a town's square") {
    // The camera moves evenly: the vectors of the frames beside are as good.
    // Jitters of other frames, in frames that are out of order, are too many changes at once.
    check_table(
        {"--scene", "demo"}, {"motion frame"},
        {{"jitter frame after + order of frames", ""}, {"jitter frame before + order of frames", "order of frames"}});
}

TEST_CASE("every mistake and every pair of mistakes is named: things that move fast") {
    // Where frames are out of order and their vectors are those of others, no reading fits enough of them.
    check_table({"--scene", "action:3"}, {},
                {{"motion frame before + order of frames", ""},
                 {"motion frame after + order of frames", "motion frame"},
                 // Halton's pattern nearly changes its sign from frame to frame.
                 {"jitter axes + jitter frame before", "jitter x + jitter y"},
                 {"jitter frame before + jitter x", "jitter y"},
                 {"jitter frame before + jitter y", "jitter x"}});
}

TEST_CASE("every mistake and every pair of mistakes is named: a procedural world") {
    // Frames beside have nearly the same vectors. Then a jitter whose axes are swapped is once missed, once blamed.
    check_table({"--scene", "procedural:5", "--path", "2"}, {"motion frame"},
                {{"jitter axes + motion frame before", ""},
                 {"motion frame before + motion.jittered", "jitter frame + jitter x + jitter y + motion.jittered"},
                 {"jitter frame before + jitter x", "jitter y + motion frame"},
                 {"jitter frame before + jitter y", "jitter x + motion frame"}},
                {{"jitter frame after + order of frames", ""},
                 {"jitter frame before + motion frame before", "jitter x + jitter y"},
                 {"jitter frame after + motion frame before", "jitter x + jitter y"}});
}

TEST_CASE("of a depth buffer encoding, direction and planes are told") {
    const Film right = rendered({"--scene", "demo", "--depth", "projective", "--reversed"});
    REQUIRE(right.sequence.depth.projective);
    const auto named = [&](const std::function<void(io::Sequence&)>& change) {
        Film film = right;
        change(film.sequence);
        return wrong_fields(check::judge(check::measure(film, pixels), film.sequence));
    };
    using Fields = std::set<std::string>;
    CHECK(named([](io::Sequence&) {}).empty());
    CHECK(named([](io::Sequence& s) { s.depth.reversed = false; }) == Fields{"depth.reversed"});
    CHECK(named([](io::Sequence& s) { s.depth.projective = false; }) == Fields{"depth.encoding"});
    const Fields planes{"depth.near, depth.far"};
    CHECK(named([](io::Sequence& s) {
              for (io::FrameFiles& frame : s.frames) frame.near_plane *= 4;
          }) == planes);
    CHECK(named([](io::Sequence& s) {
              for (io::FrameFiles& frame : s.frames) frame.far_plane = 10;
          }) == planes);
}

TEST_CASE("frames that say otherwise are named") {
    Film film = rendered({"--scene", "demo"});
    for (float& value : film.motion[5].values) value = -value;
    for (io::FrameFiles& frame : film.sequence.frames) frame.name = "frame " + frame.name;
    const check::Judgement judgement = check::judge(check::measure(film, pixels), film.sequence);
    const check::Finding* direction = judgement.find("motion.direction");
    REQUIRE(direction != nullptr);
    CHECK(direction->best == "to_previous");
    // One frame that fits another better than the one before it is left out of what else is looked at.
    CHECK(check::frames_of(*direction) == "6 of 6");
    const check::Finding* order = judgement.find("order of frames");
    REQUIRE(order != nullptr);
    CHECK(order->verdict == Verdict::cannot_tell);
    CHECK(order->against == std::vector<std::string>{"frame 0005"});
    CHECK(check::frames_of(*order) == "6 of 7, not frame 0005");

    film.motion[5] = film.motion[4];
    for (float& value : film.depth[3].values) value = 1 - value;
    const check::Judgement of_depth = check::judge(check::measure(film, pixels), film.sequence);
    const check::Finding* reversed = of_depth.find("depth.reversed");
    REQUIRE(reversed != nullptr);
    CHECK(reversed->against == std::vector<std::string>{"frame 0003"});

    check::Finding many;
    CHECK(check::frames_of(many) == "–");
    many.agree = 2;
    many.count = 7;
    many.against = {"1", "2", "3", "4", "6"};
    CHECK(check::frames_of(many) == "2 of 7, not 1 2 3 4 …");
}

TEST_CASE("sequences that say little are not accused") {
    static const Film right = rendered({"--scene", "demo", "--path", "2"});

    SUBCASE("as it is rendered") {
        CHECK(wrong_fields(check::judge(check::measure(right, pixels), right.sequence)).empty());
    }
    SUBCASE("without motion") {
        Film film = right;
        for (io::Pixels& image : film.motion) image = {};
        const check::Judgement judgement = check::judge(check::measure(film, pixels), film.sequence);
        CHECK(wrong_fields(judgement).empty());
        CHECK(judgement.find("motion.direction") == nullptr);
    }
    SUBCASE("black") {
        Film film = right;
        film.color = {};
        for (check::Plane& plane : film.luma) std::ranges::fill(plane.values, 0.0f);
        film.color.add({{1, 1}, 3, {0, 0, 0}});
        for (std::vector<io::Pixels>* images : {&film.depth, &film.motion})
            for (io::Pixels& image : *images) std::ranges::fill(image.values, 0.0f);
        const check::Judgement judgement = check::judge(check::measure(film, pixels), film.sequence);
        CHECK_FALSE(has_verdict(judgement, Verdict::wrong));
        CHECK_FALSE(has_verdict(judgement, Verdict::right));
    }
    SUBCASE("one frame") {
        Film film;
        film.sequence = right.sequence;
        film.sequence.frames.resize(1);
        film.luma = {right.luma[0]};
        film.depth = {right.depth[0]};
        film.motion = {right.motion[0]};
        CHECK(wrong_fields(check::judge(check::measure(film, pixels), film.sequence)).empty());
    }
    SUBCASE("the same picture again and again") {
        Film film = right;
        for (size_t i = 1; i < film.luma.size(); ++i) {
            film.luma[i] = film.luma[0];
            film.depth[i] = film.depth[0];
            std::ranges::fill(film.motion[i].values, 0.0f);
            film.sequence.frames[i].jitter = film.sequence.frames[0].jitter;
        }
        CHECK(wrong_fields(check::judge(check::measure(film, pixels), film.sequence)).empty());
    }
    SUBCASE("depth without a surface") {
        Film film = right;
        for (size_t i = 0; i < film.depth.size(); ++i)
            film.depth[i] = test::noise(film.depth[i].size, 1, 0, 1, static_cast<unsigned>(i));
        CHECK(wrong_fields(check::judge(check::measure(film, pixels), film.sequence)).empty());
    }
    SUBCASE("vectors that are not finite") {
        Film film = right;
        for (io::Pixels& image : film.motion) std::ranges::fill(image.values, NAN);
        CHECK(wrong_fields(check::judge(check::measure(film, pixels), film.sequence)).empty());
    }
}

TEST_CASE("the command corrects what it finds, and says so by its exit status") {
    const TemporaryFolder folder;
    const std::string path = folder / "sequence";
    const auto run = [](std::vector<std::string> arguments) {
        test::Program program(CLARUS_TOOL, arguments);
        const int status = program.result();
        return std::pair(status, program.out() + program.errors());
    };
    REQUIRE(
        run({"render", "--scene", "demo", "--size", "160x96", "--frames", "8", "--no-reference", "-o", path}).first ==
        0);
    CHECK(run({"check", path}).first == 0);
    const auto upscaled = [&](const char* model) {
        return run({"upscale", path, "--model", model, "--device", test_selector(), "-o", folder / "upscaled"});
    };
    CHECK(upscaled("fsr2").second.find("clarus check") == std::string::npos);
    io::Sequence wrong = io::read_sequence(path);
    wrong.motion.from_previous = true;
    for (io::FrameFiles& frame : wrong.frames) frame.jitter.x = -frame.jitter.x;
    write_sequence(wrong, path);
    const auto [status, text] = run({"check", path, "--fix", "--report", folder / "page.html"});
    CHECK(status == 1);
    CHECK(text.find("2 things are surely wrong") != std::string::npos);
    CHECK(upscaled("bicubic").second.find("clarus check") == std::string::npos);  // which reads no motion
    const auto [fine, warning] = upscaled("fsr2");
    CHECK(fine == 0);
    CHECK_MESSAGE(warning.find("motion.direction is from_previous, and to_previous fits better; jitter x is") !=
                      std::string::npos,
                  warning);
    CHECK(io::read_file(folder / "page.html").find("jitter x") != std::string::npos);
    const std::filesystem::path fixed = folder / "sequence" / "sequence.fixed.json";
    CHECK(run({"check", fixed.string()}).first == 0);
    const io::Sequence corrected = io::read_sequence(fixed);
    CHECK_FALSE(corrected.motion.from_previous);
    CHECK(corrected.frames[3].jitter.x == -wrong.frames[3].jitter.x);
    CHECK(io::read_sequence(path).motion.from_previous);

    const auto [again, error] = run({"check", path, "--fix"});
    CHECK(again == 1);
    CHECK(error.find("--fix would replace") != std::string::npos);
    CHECK(run({"check"}).first == 2);
}
