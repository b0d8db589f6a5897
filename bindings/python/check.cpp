#include "check/check.h"

#include <fmt/format.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "arrays.h"
#include "clarus/error.h"
#include "module.h"
#include "words.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace clarus::python {
namespace {

constexpr size_t pixels_of_a_pair = 4000;  // as `clarus check` compares

/// One for each frame, or none. Errors: invalid_argument.
void require_count(const char* argument, size_t count, size_t frames) {
    if (count != frames)
        throw Error(ErrorKind::invalid_argument,
                    fmt::format("{}: {} of them, but {} frames of color", argument, count, frames));
}

/// A frame's image of so many channels, or an empty one for None. Errors: invalid_argument, naming it.
io::Pixels image_of(const char* argument, size_t frame, nb::handle object, int channels, std::optional<Size> size) {
    if (object.is_none()) return {};
    const std::string name = fmt::format("{}[{}]", argument, frame);
    io::Pixels image = values_of(name, object, channels);
    if (size && image.size != *size)
        throw Error(ErrorKind::invalid_argument,
                    fmt::format("{}: {} columns and {} rows, but color[0] has {} and {}", name, image.size.width,
                                image.size.height, size->width, size->height));
    return image;
}

Vec2 jitter_of(size_t frame, std::pair<float, float> given) {
    if (!(std::abs(given.first) <= 1 && std::abs(given.second) <= 1))
        throw Error(ErrorKind::invalid_argument,
                    fmt::format("jitter[{}]: ({}, {}); each must be from -1 to 1 render pixel", frame, given.first,
                                given.second));
    return {given.first, given.second};
}

using Images = std::vector<nb::object>;
using Vectors = std::vector<std::pair<float, float>>;

/// What the arguments say, as docs/python.md has them.
struct Declared {
    const Images& color;
    const std::optional<Images>&depth, &motion;
    const std::optional<Vectors>& jitter;
    const std::optional<std::vector<bool>>& reset;
    std::pair<float, float> motion_scale;
    float near_plane, far_plane;
};

void add_frame(check::Film& film, const Declared& declared, size_t frame) {
    const auto size = frame ? std::optional(film.sequence.render_size) : std::nullopt;
    io::FramePixels pixels;
    pixels.color = image_of("color", frame, declared.color[frame], 3, size);
    if (pixels.color.values.empty()) throw Error(ErrorKind::invalid_argument, fmt::format("color[{}]: None", frame));
    film.sequence.render_size = pixels.color.size;
    if (declared.depth) pixels.depth = image_of("depth", frame, (*declared.depth)[frame], 1, pixels.color.size);
    if (declared.motion) pixels.motion = image_of("motion", frame, (*declared.motion)[frame], 2, pixels.color.size);
    for (size_t i = 0; i < pixels.motion.values.size(); i += 2) {
        pixels.motion.values[i] *= declared.motion_scale.first;
        pixels.motion.values[i + 1] *= declared.motion_scale.second;
    }
    io::FrameFiles described;
    described.name = fmt::format("{}", frame);
    if (declared.jitter) described.jitter = jitter_of(frame, (*declared.jitter)[frame]);
    described.reset = declared.reset && (*declared.reset)[frame];
    described.near_plane = declared.near_plane;
    described.far_plane = declared.far_plane;
    film.sequence.frames.push_back(std::move(described));
    film.add(std::move(pixels));
}

check::Film film_of(const Declared& declared) {
    const size_t frames = declared.color.size();
    if (frames == 0) throw Error(ErrorKind::invalid_argument, "color: no frames");
    if (declared.depth) require_count("depth", declared.depth->size(), frames);
    if (declared.motion) require_count("motion", declared.motion->size(), frames);
    if (declared.jitter) require_count("jitter", declared.jitter->size(), frames);
    if (declared.reset) require_count("reset", declared.reset->size(), frames);
    check::Film film;
    for (size_t frame = 0; frame < frames; ++frame) add_frame(film, declared, frame);
    return film;
}

constexpr const char* check_help =
    R"(What frames say of their conventions, held against what is declared of them: docs/checking.md. A Finding a field.

`color`, `depth`, `motion`: an array a frame, as Upscaler.upscale takes them; None where there is none. `jitter` and
`reset` likewise: one a frame. The rest is what Upscaler takes. Motion is read as `motion_scale` makes it: in render
pixels, to the previous frame, y down. Eight frames that move, with jitter, tell most; needs no device.

Other threads of Python run meanwhile. Raises InvalidArgumentError.)";

constexpr const char* check_signature =
    "def check(color: collections.abc.Sequence, depth: collections.abc.Sequence | None = None, "
    "motion: collections.abc.Sequence | None = None, *, "
    "jitter: collections.abc.Sequence[tuple[float, float]] | None = None, "
    "reset: collections.abc.Sequence[bool] | None = None, scale: float = 2.0, color_space: str = 'srgb', "
    "depth_projective: bool = False, depth_reversed: bool = False, near_plane: float = 0.0, far_plane: float = 0.0, "
    "motion_scale: tuple[float, float] = (1.0, 1.0), motion_jittered: bool = False, "
    "motion_sampled_at_jitter: bool = False) -> list[Finding]";

}  // namespace

void add_check(nb::module_& module) {
    using check::Finding;
    nb::class_<Finding>(module, "Finding", "Of check: a field of what is declared, and what the frames say of it.")
        .def_ro("field", &Finding::field, "\"motion.direction\", \"jitter x\", …")
        .def_ro("declared", &Finding::declared)
        .def_ro("best", &Finding::best, "What fits best, even where nothing can be told.")
        .def_ro("gain", &Finding::gain,
                "In dB: of what fits best over what is declared; where that is the same, over all else.")
        .def_prop_ro(
            "verdict", [](const Finding& finding) { return check::word(finding.verdict); },
            "\"right\" and \"wrong\" for sure, or \"cannot tell\".")
        .def_ro("agree", &Finding::agree, "Frames, or pairs of frames, that say so.")
        .def_ro("count", &Finding::count, "Of how many.")
        .def_ro("against", &Finding::against,
                "Which of them, for sure, do not, by their number: of pairs, the second's.")
        .def_ro("note", &Finding::note)
        .def("__repr__", [](const Finding& finding) {
            return fmt::format("<clarus.Finding {}: {}, {} fits best, {:.1f} dB: {}>", finding.field, finding.declared,
                               finding.best, finding.gain, check::word(finding.verdict));
        });
    module.def(
        "check",
        [](const Images& color, const std::optional<Images>& depth, const std::optional<Images>& motion,
           const std::optional<Vectors>& jitter, const std::optional<std::vector<bool>>& reset, double scale,
           const std::string& color_space, bool depth_projective, bool depth_reversed, float near_plane,
           float far_plane, std::pair<float, float> motion_scale, bool motion_jittered, bool motion_sampled_at_jitter) {
            if (depth && depth_projective && !(near_plane > 0 && far_plane > near_plane))
                throw Error(ErrorKind::invalid_argument,
                            fmt::format("near_plane {}, far_plane {}: must be 0 < near < far", near_plane, far_plane));
            check::Film film = film_of({color, depth, motion, jitter, reset, motion_scale, near_plane, far_plane});
            film.sequence.scale = scale;
            film.sequence.color_space = color_space_of(color_space);
            film.sequence.depth = {depth_projective, depth_reversed};
            film.sequence.motion.jittered = motion_jittered;
            film.sequence.motion.sampled_at_jitter = motion_sampled_at_jitter;
            const nb::gil_scoped_release others_may_run;
            return check::judge(check::measure(film, pixels_of_a_pair), film.sequence).findings;
        },
        nb::sig(check_signature), "color"_a, "depth"_a = nb::none(), "motion"_a = nb::none(), nb::kw_only(),
        "jitter"_a = nb::none(), "reset"_a = nb::none(), "scale"_a = 2.0, "color_space"_a = "srgb",
        "depth_projective"_a = false, "depth_reversed"_a = false, "near_plane"_a = 0.0f, "far_plane"_a = 0.0f,
        "motion_scale"_a = std::pair(1.0f, 1.0f), "motion_jittered"_a = false, "motion_sampled_at_jitter"_a = false,
        check_help);
}

}  // namespace clarus::python
