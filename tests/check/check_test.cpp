#include "check/check.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "io/frames.h"
#include "program.h"
#include "temporary_folder.h"

using namespace clarus;
using check::Film;
using check::Verdict;

namespace {

constexpr size_t pixels = 600;

Film film_of(const io::Sequence& sequence) {
    Film film;
    film.sequence = sequence;
    for (size_t i = 0; i < sequence.frames.size(); ++i) film.add(io::read_frame(sequence, i, true, false));
    return film;
}

Film rendered(std::vector<std::string> arguments) {
    const TemporaryFolder folder;
    for (const char* word : {"render", "--size", "160x96", "--frames", "8", "--no-reference", "--threads", "1", "-o"})
        arguments.emplace_back(word);
    arguments.push_back(folder / "sequence");
    std::rotate(arguments.begin(), std::ranges::find(arguments, "render"), arguments.end());
    test::Program program(CLARUS_TOOL, arguments);
    REQUIRE(program.result() == 0);
    return film_of(io::read_sequence(folder / "sequence"));
}

/// What is made wrong: in what the JSON says, or in what the files hold.
struct Mistake {
    std::string field;  // as Finding::field
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
        mistakes.push_back({field, change, {}});
    };
    const auto store = [&](const char* field, const std::function<void(Film&)>& change) {
        mistakes.push_back({field, {}, change});
    };
    declare("motion.unit", [](io::Sequence& s) { s.motion.unit = io::MotionUnit::uv; });
    declare("motion.direction", [](io::Sequence& s) { s.motion.from_previous = true; });
    declare("motion.y", [](io::Sequence& s) { s.motion.y_up = true; });
    declare("motion.jittered", [](io::Sequence& s) { s.motion.jittered = true; });
    declare("motion.sampled_at", [](io::Sequence& s) { s.motion.sampled_at_jitter = false; });
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
    store("motion frame", [](Film& film) { shift(film.motion, -1); });
    store("motion frame", [](Film& film) { shift(film.motion, 1); });
    store("depth frame", [](Film& film) { shift(film.depth, -1); });
    store("depth frame", [](Film& film) { shift(film.depth, 1); });
    store("jitter x", [](Film& film) { each_jitter(film, [](Vec2 j) { return Vec2{-j.x, j.y}; }); });
    store("jitter y", [](Film& film) { each_jitter(film, [](Vec2 j) { return Vec2{j.x, -j.y}; }); });
    store("jitter axes", [](Film& film) { each_jitter(film, [](Vec2 j) { return Vec2{j.y, j.x}; }); });
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
std::map<std::string, std::string> surprises(const Film& right) {
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
            std::set<std::string> made;
            for (const size_t i : std::set{a, b}) {
                if (i == none) continue;
                made.insert(mistakes[i].field);
                if (!mistakes[i].in_files) continue;
                mistakes[i].in_files(film);
                (files.first == none ? files.first : files.second) = i;
            }
            if (!measured.contains(files)) measured[files] = check::measure(film, pixels);
            io::Sequence declared = film.sequence;
            for (const size_t i : std::set{a, b})
                if (i != none && mistakes[i].in_json) mistakes[i].in_json(declared);
            const std::set<std::string> found = wrong_fields(check::judge(measured[files], declared));
            if (found != made) result[listed(made)] = listed(found);
        }
    return result;
}

void check_table(const std::vector<std::string>& scene, const std::map<std::string, std::string>& expected) {
    const std::map<std::string, std::string> found = surprises(rendered(scene));
    for (const auto& [made, named] : found) {
        INFO("made: ", made, "; named: ", named);
        const auto known = expected.find(made);
        CHECK(known != expected.end());
        if (known != expected.end()) CHECK(known->second == named);
    }
    for (const auto& [made, named] : expected) {
        INFO("expected to be found otherwise: ", made);
        CHECK(found.contains(made));
    }
}

}  // namespace

TEST_CASE("every mistake and every pair of mistakes is named: a town's square") {
    check_table({"--scene", "demo"}, {});
}

TEST_CASE("every mistake and every pair of mistakes is named: things that move fast") {
    check_table({"--scene", "action:3"}, {});
}

TEST_CASE("every mistake and every pair of mistakes is named: a procedural world") {
    check_table({"--scene", "procedural:5", "--path", "2"}, {});
}
