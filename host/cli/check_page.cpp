#include "cli/check_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <vector>

#include "check/shift.h"
#include "cli/image_folder.h"
#include "io/frames.h"
#include "metrics/display.h"
#include "report/base64.h"
#include "report/page.h"

namespace clarus::cli {
namespace {

using Json = nlohmann::ordered_json;

constexpr size_t most_pictures = 4;  // frames that are shown

std::string data_url(const char* name, const io::Pixels& pixels) {
    const std::vector<unsigned char> file = io::encode_image(name, pixels, io::SampleType::u8);
    const bool is_png = std::string_view(name).ends_with(".png");
    return fmt::format("data:image/{};base64,{}", is_png ? "png" : "jpeg", report::base64(file));
}

/// The vector's direction as hue, its length up to `longest` as how much of it: none is grey.
void paint(io::Pixels& picture, int x, int y, Vec2 vector, float longest) {
    const float length = std::hypot(vector.x, vector.y);
    const float strength = longest > 0 && std::isfinite(length) ? std::min(length / longest, 1.0f) : 0;
    const float hue = std::atan2(vector.y, vector.x);
    for (int channel = 0; channel < 3; ++channel) {
        const float turn = 2 * std::numbers::pi_v<float> * static_cast<float>(channel) / 3;
        picture.at(x, y, channel) = 0.5f + 0.45f * strength * std::cos(hue - turn);
    }
}

io::Pixels blank(Size size) {
    return {size, 3,
            std::vector<float>(size_t{3} * static_cast<size_t>(size.width) * static_cast<size_t>(size.height))};
}

/// All vectors up to the longest, at the place that they point to from the middle.
io::Pixels legend() {
    constexpr int side = 96;
    constexpr float radius = side / 2.0f;
    io::Pixels picture = blank({side, side});
    for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x) {
            const Vec2 vector{static_cast<float>(x) + 0.5f - radius, static_cast<float>(y) + 0.5f - radius};
            paint(picture, x, y, std::hypot(vector.x, vector.y) <= radius ? vector : Vec2{}, radius);
        }
    return picture;
}

struct VectorPicture {
    io::Pixels pixels;
    float longest;  // render pixels: what the legend's rim is
};

VectorPicture picture_of_vectors(const check::Film& film, size_t frame, const check::Reading& reading) {
    const io::Pixels& motion = *film.motion_of(frame, reading);
    VectorPicture result{blank(motion.size), 4 * check::length_of_movers(motion)};
    const Vec2 unit = reading.displacement({1, 1}, motion.size, film.sequence.scale);
    result.longest *= std::max(std::abs(unit.x), std::abs(unit.y));
    for (int y = 0; y < motion.size.height; ++y)
        for (int x = 0; x < motion.size.width; ++x)
            paint(result.pixels, x, y,
                  reading.displacement({motion.at(x, y, 0), motion.at(x, y, 1)}, motion.size, film.sequence.scale),
                  result.longest);
    return result;
}

Json pictures_of(const check::Film& film, check::Pair pair, const check::Reading& declared,
                 const check::Reading& best) {
    const io::Sequence& sequence = film.sequence;
    const auto shown = [&](size_t index) {
        return metrics::display_values(io::read_frame(sequence, index, false, false).color, sequence.color_space,
                                       sequence.frames[index].exposure);
    };
    const io::Pixels before = shown(pair.before);
    Json json{{"name", sequence.frames[pair.frame].name},
              {"present", data_url("picture.jpg", shown(pair.frame))},
              {"declared", data_url("picture.jpg", check::warped(film, pair, declared, before))},
              {"best", data_url("picture.jpg", check::warped(film, pair, best, before))}};
    if (film.motion_of(pair.frame, best)) {
        const VectorPicture vectors = picture_of_vectors(film, pair.frame, best);
        json["vectors"] = data_url("picture.jpg", vectors.pixels);
        json["longest"] = vectors.longest;
    }
    return json;
}

}  // namespace

std::string check_page(const check::Film& film, const check::Evidence& evidence, const check::Judgement& judgement,
                       const std::filesystem::path& sequence) {
    Json data{{"title", cli::name_of(sequence)}};
    for (const char* key : {"findings", "pictures", "jitter"}) data[key] = Json::array();
    for (const check::Finding& one : judgement.findings) {
        data["findings"].push_back({{"field", one.field},
                                    {"declared", one.declared},
                                    {"best", one.best},
                                    {"gain", one.gain},
                                    {"verdict", check::word(one.verdict)},
                                    {"frames", check::frames_of(one)},
                                    {"note", one.note}});
    }
    const std::vector<check::Pair>& pairs = evidence.warps.pairs;
    const check::Reading declared = check::declared_reading(film.sequence);
    const size_t shown = std::min(most_pictures, pairs.size());
    for (size_t i = 0; i < shown; ++i)
        data["pictures"].push_back(
            pictures_of(film, pairs[shown == 1 ? 0 : i * (pairs.size() - 1) / (shown - 1)], declared, evidence.best));
    if (evidence.has_motion) data["legend"] = data_url("legend.png", legend());
    if (evidence.has_jitter)
        for (size_t i = 0; i < pairs.size(); ++i) {
            const Vec2 measured = check::measure_shift(film, pairs[i], evidence.best);
            if (std::isfinite(measured.x) && std::isfinite(measured.y))
                data["jitter"].push_back({{"name", film.sequence.frames[pairs[i].frame].name},
                                          {"declared", {evidence.jitter[i].x, evidence.jitter[i].y}},
                                          {"measured", {measured.x, measured.y}}});
        }
    return report::page(data, "check.html");
}

}  // namespace clarus::cli
