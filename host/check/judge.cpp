#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "check/check.h"
#include "check/jitter_in_motion.h"
#include "check/statistics.h"

namespace clarus::check {

const char* word(Verdict verdict) {
    switch (verdict) {
        case Verdict::right:
            return "right";
        case Verdict::wrong:
            return "wrong";
        case Verdict::cannot_tell:
            break;
    }
    return "cannot tell";
}

std::string frames_of(const Finding& one) {
    constexpr size_t most = 4;
    if (one.count == 0) return "–";
    std::string text = fmt::format("{} of {}", one.agree, one.count);
    if (one.against.empty() || one.agree == 0) return text;
    const std::span named(one.against.begin(), std::min(most, one.against.size()));
    text += fmt::format(", not {}", fmt::join(named, " "));
    if (named.size() < one.against.size()) text += " …";
    return text;
}

namespace {

// Decibels that an answer must be better by on average, to be sure of it.
constexpr double least_of_warps = 0.3;
constexpr double least_of_hidden = 3;
constexpr double least_of_curvature = 3;
constexpr double least_of_motion_frames = 0.5;
constexpr double least_of_cameras = 3;

/// What errors are measured of: WarpErrors::pairs, or frames.
enum class Each { pair, frame };

/// Of some answers, the one that fits best, with its advantage over the declared one; where that is the same, over the
/// best of the rest.
struct Choice {
    size_t best;
    Advantage advantage;
};

Choice choose(const std::vector<std::vector<float>>& errors, size_t declared) {
    Choice result{declared, {}};
    double best_gain = 0;
    for (size_t i = 0; i < errors.size(); ++i) {
        const Advantage over = advantage(errors[i], errors[declared]);
        if (i != declared && over.count > 0 && over.gain > best_gain) result = {i, over}, best_gain = over.gain;
    }
    if (result.best != declared) return result;
    double least = std::numeric_limits<double>::infinity();
    for (size_t i = 0; i < errors.size(); ++i) {
        const Advantage over = advantage(errors[declared], errors[i]);
        if (i != declared && over.count > 0 && over.gain < least) result.advantage = over, least = over.gain;
    }
    return result;
}

template <size_t N>
std::vector<std::vector<float>> listed(const Answers<N>& answers) {
    return {answers.begin(), answers.end()};
}

/// How many fields differ. Jitters of another frame count twice: patterns such as Halton's nearly change their sign
/// from frame to frame.
size_t distance(const Reading& a, const Reading& b) {
    size_t sum = 0;
    for (const Field field : all_fields) {
        if (is_of_jitter(field) && (a.jittered || b.jittered)) continue;  // one of them has no such field
        if (number_of(field, a) != number_of(field, b)) sum += field == Field::jitter_frame ? 2 : 1;
    }
    return sum;
}

class Judge {
  public:
    Judge(const Evidence& evidence, const io::Sequence& sequence) : evidence_(evidence), sequence_(sequence) {}

    Judgement run() {
        judge_order();
        judge_color();
        result_.correction.reading = declared_reading(sequence_);
        if (evidence_.has_motion || evidence_.has_jitter) judge_warps();
        if (evidence_.has_depth) judge_depth();
        return std::move(result_);
    }

  private:
    std::string frame_at(Each each, size_t place) const {
        const size_t frame = each == Each::pair ? evidence_.warps.pairs[place].frame : place;
        return sequence_.frames[evidence_.order.empty() ? frame : evidence_.order[frame]].name;
    }

    Finding finding(std::string field, std::string declared, std::string best, const Advantage& advantage, bool is_sure,
                    Each each = Each::pair) const {
        const bool same = declared == best;
        Finding one{.field = std::move(field),
                    .declared = std::move(declared),
                    .best = std::move(best),
                    .gain = advantage.gain,
                    .verdict = !is_sure ? Verdict::cannot_tell
                               : same   ? Verdict::right
                                        : Verdict::wrong,
                    .agree = advantage.agree,
                    .count = advantage.count,
                    .against = {},
                    .note = {}};
        if (is_sure)
            for (const size_t place : advantage.against) one.against.push_back(frame_at(each, place));
        return one;
    }

    void add(Finding one) { result_.findings.push_back(std::move(one)); }

    void judge_order() {
        Finding one{.field = "order of frames", .declared = "as given", .best = "as given", .against = {}, .note = {}};
        one.count = evidence_.ordered;
        one.agree = evidence_.ordered - evidence_.misplaced.size();
        if (evidence_.misplaced.size() > 1) {
            one.best = "another";
            one.verdict = Verdict::wrong;
            for (const auto& [before, frame] : evidence_.misplaced)
                one.note += fmt::format("{}frame {} follows {}", one.note.empty() ? "" : ", ",
                                        sequence_.frames[frame].name, sequence_.frames[before].name);
            result_.correction.order = evidence_.order;
            if (result_.correction.order.empty()) result_.correction.unsayable.push_back(one.field);
            one.agree = evidence_.misplaced.size();
        } else if (!evidence_.misplaced.empty()) {
            one.against.push_back(sequence_.frames[evidence_.misplaced.front().frame].name);
        } else if (evidence_.ordered >= 3) {
            one.verdict = Verdict::right;
        }
        add(one);
    }

    void judge_color() {
        const bool is_linear = sequence_.color_space == ColorSpace::linear;
        Finding one{
            .field = "color_space", .declared = is_linear ? "linear" : "srgb", .best = {}, .against = {}, .note = {}};
        one.best = one.declared;
        one.count = evidence_.frames;
        const ColorTraits& traits = evidence_.color;
        const auto say = [&](const char* best, const char* note) {
            one.best = best;
            one.note = note;
            one.agree = one.count;
            one.verdict = one.best == one.declared ? Verdict::right : Verdict::wrong;
        };
        if (traits.above_one * 1000 > traits.values)
            say("linear", "values above 1, which display colours do not have");
        else if (traits.is_eight_bit && traits.has_variety())
            say("srgb", "all values are of 8 bits, too few for light");
        if (one.verdict == Verdict::wrong)
            result_.correction.color_space = is_linear ? ColorSpace::srgb : ColorSpace::linear;
        add(one);
    }

    /// Of the readings that the best one does not surely beat, that with the fewest changes of what is declared.
    Reading chosen(const Reading& declared) const {
        const WarpErrors& warps = evidence_.warps;
        const std::vector<float>& best = warps.errors[warps.index_of(evidence_.best)];
        Reading result = evidence_.best;
        size_t changes = distance(result, declared);
        double lag = 0;
        for (size_t r = 0; r < warps.readings.size(); ++r) {
            const Advantage over = advantage(best, warps.errors[r]);
            const size_t changed = distance(warps.readings[r], declared);
            if (over.count == 0 || over.is_sure(least_of_warps)) continue;
            if (changed < changes || (changed == changes && over.gain < lag))
                result = warps.readings[r], changes = changed, lag = over.gain;
        }
        return result;
    }

    /// The best of those readings that have, or have not, this value of a field.
    const std::vector<float>* best_with(Field field, int number, bool has) const {
        const WarpErrors& warps = evidence_.warps;
        const std::vector<float>* best = nullptr;
        for (size_t r = 0; r < warps.readings.size(); ++r) {
            if (is_of_jitter(field) && warps.readings[r].jittered) continue;
            if ((number_of(field, warps.readings[r]) == number) != has) continue;
            if (!best) {
                if (advantage(warps.errors[r], warps.errors[r]).count > 0) best = &warps.errors[r];
                continue;
            }
            const Advantage over = advantage(warps.errors[r], *best);
            if (over.count > 0 && over.gain > 0) best = &warps.errors[r];
        }
        return best;
    }

    bool applies(Field field) const {
        if (field == Field::jittered || is_of_jitter(field)) return evidence_.has_jitter;
        return evidence_.has_motion;
    }

    void judge_warps() {
        const Reading declared = declared_reading(sequence_);
        const WarpErrors& warps = evidence_.warps;
        if (warps.pairs.empty()) {
            for (const Field field : all_fields)
                if (applies(field))
                    add(finding(name_of(field), value_of(field, declared), value_of(field, declared), {}, false));
            return;
        }
        const Reading fits = chosen(declared);
        const std::vector<float>& least = warps.errors[warps.index_of(fits)];
        Reading corrected = declared;
        bool corrects_jittered = false;
        for (const Field field : all_fields) {
            if (!applies(field) || (is_of_jitter(field) && fits.jittered)) continue;
            const bool is_new = is_of_jitter(field) && declared.jittered;  // declared says nothing of its sign
            const int number = is_new ? 0 : number_of(field, declared);
            const bool changed = number_of(field, fits) != number;
            const std::vector<float>* other = best_with(field, number_of(field, fits), false);
            if (changed) other = best_with(field, number, true);
            const Advantage over = other ? advantage(least, *other) : Advantage{};
            Finding one = finding(name_of(field), value_of(field, is_new ? Reading{} : declared), value_of(field, fits),
                                  over, over.is_sure(least_of_warps));
            if (field == Field::motion_frame) one = motion_frame(one);
            const bool is_new_value = one.best != one.declared;
            if (is_new_value && changed && one.verdict == Verdict::cannot_tell) {
                one.verdict = Verdict::wrong;
                one.note = "or another field that makes up for it";
            }
            if (is_new_value && (changed || one.verdict == Verdict::wrong)) take_over(field, fits, one, corrected);
            corrects_jittered = corrects_jittered || (field == Field::jittered && changed);
            add(std::move(one));
        }
        if (fits.jittered && evidence_.has_jitter) judge_jitter_in_motion(corrects_jittered, corrected);
        result_.correction.reading = corrected;
    }

    /// At the places where it matters, which says more than all places together.
    Finding motion_frame(const Finding& by_warps) const {
        const Choice choice = choose(listed(evidence_.motion_frames), 0);
        if (!choice.advantage.is_sure(least_of_motion_frames)) return by_warps;
        Reading best;
        best.motion_frame = frame_of_answer(choice.best);
        return finding(by_warps.field, by_warps.declared, value_of(Field::motion_frame, best), choice.advantage, true);
    }

    static int frame_of_answer(size_t answer) { return answer == 0 ? 0 : answer == 1 ? -1 : 1; }

    void take_over(Field field, const Reading& fits, const Finding& one, Reading& corrected) {
        switch (field) {
            case Field::unit:
                corrected.unit = fits.unit;
                if (fits.unit != Unit::pixels && fits.unit != Unit::uv)
                    result_.correction.unsayable.push_back("motion.unit: " + one.best);
                break;
            case Field::direction:
                corrected.from_previous = fits.from_previous;
                break;
            case Field::y:
                corrected.y_up = fits.y_up;
                break;
            case Field::motion_axes:
                corrected.motion_axes_swapped = fits.motion_axes_swapped;
                result_.correction.unsayable.push_back("motion axes: " + one.best);
                break;
            case Field::motion_frame:
                corrected.motion_frame = one.best == value_of(field, fits) ? fits.motion_frame
                                         : one.best == "its own"           ? 0
                                         : one.best == "the next frame's"  ? 1
                                                                           : -1;
                break;
            case Field::jittered:
                corrected.jittered = fits.jittered;
                break;
            case Field::jitter_x:
                corrected.jitter_x_flipped = fits.jitter_x_flipped;
                break;
            case Field::jitter_y:
                corrected.jitter_y_flipped = fits.jitter_y_flipped;
                break;
            case Field::jitter_axes:
                corrected.jitter_axes_swapped = fits.jitter_axes_swapped;
                break;
            case Field::jitter_frame:
                corrected.jitter_frame = fits.jitter_frame;
                break;
        }
    }

    /// Where colour needs no jitter beside the vectors: either they have it, or there is none.
    void judge_jitter_in_motion(bool corrects_jittered, Reading& corrected) {
        const JitterInMotion found = find_jitter_in_motion(evidence_.motion, evidence_.jitter);
        const auto jittered = std::ranges::find(result_.findings, name_of(Field::jittered), &Finding::field);
        if (!evidence_.has_motion || found.is_absent) {
            // Vectors do not follow the jitter, and colour does not either.
            if (corrects_jittered || !evidence_.has_motion || sequence_.motion.jittered) {
                Finding one = *jittered;
                one.field = "jitter";
                one.declared = "given";
                one.best = "none in the frames";
                one.note = found.is_absent ? "neither colour nor vectors follow it" : "colour does not follow it";
                if (sequence_.motion.jittered) one.verdict = Verdict::wrong;
                result_.correction.no_jitter = one.verdict == Verdict::wrong;
                corrected.jittered = sequence_.motion.jittered;
                *jittered = std::move(one);
            }
            return;
        }
        if (!found.is_there && corrects_jittered) jittered->note = "or there is no jitter in the frames";
        Reading fits;
        fits.jitter_x_flipped = found.x_flipped;
        fits.jitter_y_flipped = found.y_flipped;
        fits.jitter_axes_swapped = found.axes_swapped;
        for (const Field field : {Field::jitter_x, Field::jitter_y, Field::jitter_axes}) {
            Finding one =
                finding(name_of(field), value_of(field, Reading{}), value_of(field, found.is_there ? fits : Reading{}),
                        {.gain = found.gain, .t = 0, .agree = found.count, .count = found.count}, found.is_there);
            one.note = found.is_there ? "by the vectors, which have it" : "";
            if (one.verdict == Verdict::wrong) take_over(field, fits, one, corrected);
            add(std::move(one));
        }
    }

    void judge_depth() {
        judge_depth_form();
        judge_depth_planes();
        judge_depth_frame();
    }

    static const char* word(bool reversed) { return reversed ? "true" : "false"; }

    void judge_depth_form() {
        const auto [projective, reversed] = sequence_.depth;
        const auto& forms = evidence_.depth.curvature;
        const size_t declared = projective ? 2 : reversed ? 1 : 0;
        const Choice form = choose(listed(forms), declared);
        const bool is_sure = form.advantage.is_sure(least_of_curvature);
        const auto encoding = [](size_t answer) { return answer == 2 ? "projective" : "linear"; };
        // Against the other encoding, not the other direction.
        Advantage of_encoding = form.advantage;
        if ((form.best == 2) == projective)
            of_encoding = projective ? advantage(forms[2], forms[advantage(forms[0], forms[1]).gain > 0 ? 0 : 1])
                                     : advantage(forms[form.best], forms[2]);
        Finding one = finding("depth.encoding", encoding(declared), encoding(form.best), of_encoding,
                              of_encoding.is_sure(least_of_curvature), Each::frame);
        one.note = "by planes";
        if (one.verdict == Verdict::wrong) {
            result_.correction.depth_projective = form.best == 2;
            if (form.best == 2) result_.correction.unsayable.push_back("depth.near and depth.far, which nothing tells");
        }
        add(one);

        // Linear depth bends planes another way where it is reversed. Of depth buffers, what hides tells.
        if (is_sure && form.best < 2) {
            Advantage over = form.advantage;
            if (form.best == static_cast<size_t>(reversed)) over = advantage(forms[form.best], forms[1 - form.best]);
            Finding direction = finding("depth.reversed", word(reversed), word(form.best == 1), over,
                                        over.is_sure(least_of_curvature), Each::frame);
            direction.note = "by planes";
            if (direction.verdict != Verdict::cannot_tell) return add_reversed(std::move(direction));
        }
        if (form.best == 2) {
            const auto& errors = evidence_.depth.reprojected;
            const size_t first = projective ? 2 : 4;
            const Choice cameras = choose({errors[first], errors[first + 1]}, reversed ? 1 : 0);
            if (cameras.advantage.is_sure(least_of_cameras)) {
                Finding direction =
                    finding("depth.reversed", word(reversed), word(cameras.best == 1), cameras.advantage, true);
                direction.note = "by the cameras";
                return add_reversed(std::move(direction));
            }
        }
        const auto offered = [](const std::vector<float>& counts) {
            constexpr float a_few = 5;  // pixels, which say nothing
            std::vector<float> errors;
            for (const float count : counts) errors.push_back(count + a_few);
            return errors;
        };
        // Hidden by smaller ones is what does not fit reversed depth.
        const Choice hiding =
            choose({offered(evidence_.depth.hidden_by[0]), offered(evidence_.depth.hidden_by[1])}, reversed ? 1 : 0);
        Finding direction = finding("depth.reversed", word(reversed), word(hiding.best == 1), hiding.advantage,
                                    hiding.advantage.is_sure(least_of_hidden));
        direction.note = "by what hides";
        add_reversed(std::move(direction));
    }

    void add_reversed(Finding one) {
        if (one.verdict == Verdict::wrong) result_.correction.depth_reversed = one.best == "true";
        add(std::move(one));
    }

    /// Near and far of a depth buffer, against the cameras'.
    void judge_depth_planes() {
        if (!sequence_.depth.projective) return;
        const io::FrameFiles& frame = sequence_.frames.back();
        const auto words = [](float near, float far) { return fmt::format("{:g}, {:g}", near, far); };
        const std::string declared = words(frame.near_plane, frame.far_plane);
        if (!frame.camera) return add(finding("depth.near, depth.far", declared, declared, {}, false));
        const auto& errors = evidence_.depth.reprojected;
        const bool reversed = result_.correction.depth_reversed.value_or(sequence_.depth.reversed);
        const Choice choice = choose({errors[reversed ? 3 : 2], errors[reversed ? 5 : 4]}, 0);
        const std::string cameras = words(frame.camera->near_plane, frame.camera->far_plane);
        Finding one = finding("depth.near, depth.far", declared, choice.best == 0 ? declared : cameras,
                              choice.advantage, choice.advantage.is_sure(least_of_cameras));
        one.note = declared == cameras ? "as the cameras have them" : "by the cameras";
        if (one.verdict == Verdict::wrong) result_.correction.unsayable.push_back(one.field + ": " + one.best);
        add(std::move(one));
    }

    void judge_depth_frame() {
        const Choice choice = choose(listed(evidence_.depth_edges), 0);
        Reading best;
        best.motion_frame = frame_of_answer(choice.best);
        Finding one = finding("depth frame", "its own", value_of(Field::motion_frame, best), choice.advantage,
                              choice.advantage.is_sure(least_of_edges), Each::frame);
        one.note = "by its edges on those of colour";
        if (one.verdict == Verdict::wrong) result_.correction.depth_frame = best.motion_frame;
        add(std::move(one));
    }

    const Evidence& evidence_;
    const io::Sequence& sequence_;
    Judgement result_;
};

}  // namespace

bool Judgement::is_wrong() const {
    return std::ranges::any_of(findings, [](const Finding& one) { return one.verdict == Verdict::wrong; });
}

const Finding* Judgement::find(const std::string& field) const {
    const auto found = std::ranges::find(findings, field, &Finding::field);
    return found == findings.end() ? nullptr : &*found;
}

Judgement judge(const Evidence& evidence, const io::Sequence& declared) { return Judge(evidence, declared).run(); }

}  // namespace clarus::check
