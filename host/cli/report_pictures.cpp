#include "cli/report_pictures.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "io/image.h"
#include "metrics/blocks.h"
#include "metrics/psnr.h"
#include "report/base64.h"

namespace clarus::cli {
namespace {

using Json = nlohmann::ordered_json;

constexpr size_t most_places = 40;  // of a result in the page

/// An image as it stands in the page; `name` tells its format.
std::string data_url(const std::filesystem::path& name, const io::Pixels& pixels) {
    const std::vector<unsigned char> file = io::encode_image(name, pixels, io::SampleType::u8);
    const char* type = name.extension() == ".png" ? "png" : "jpeg";
    return fmt::format("data:image/{};base64,{}", type, report::base64(file));
}

/// Another one where the file was written anew.
std::string key_of(const std::filesystem::path& file, ColorSpace color_space) {
    return fmt::format("{}\n{}\n{}", file.string(), std::filesystem::last_write_time(file).time_since_epoch().count(),
                       static_cast<int>(color_space));
}

}  // namespace

std::vector<size_t> evenly_spaced(size_t count, size_t most) {
    std::vector<size_t> indices;
    const size_t shown = std::min(count, most);
    for (size_t i = 0; i < shown; ++i) indices.push_back(shown == 1 ? 0 : i * (count - 1) / (shown - 1));
    return indices;
}

std::vector<size_t> steadily_spaced(size_t count, size_t most) {
    std::vector<size_t> indices;
    if (count == 0) return indices;
    size_t step = 1;  // doubled, so that every second one stays
    while ((count - 2 + step) / step + 1 > std::max<size_t>(most, 2)) step *= 2;
    for (size_t i = 0; i + 1 < count; i += step) indices.push_back(i);
    indices.push_back(count - 1);
    return indices;
}

const PictureCache::Picture& PictureCache::find(const std::string& key, const std::function<Picture()>& make) {
    if (const auto found = recent_.find(key); found != recent_.end()) return found->second;
    if (auto before = older_.extract(key)) return recent_.insert(std::move(before)).position->second;
    return recent_.emplace(key, make()).first->second;
}

void PictureCache::age() { older_ = std::exchange(recent_, {}); }

Pictures::Pictures(std::span<const Reference> references, std::vector<size_t> indices, bool lossless,
                   PictureCache* cache)
    : references_(references),
      indices_(std::move(indices)),
      name_(lossless ? "picture.png" : "picture.jpg"),
      cache_(cache) {}

Json Pictures::source(const std::string& name, const char* kind,
                      const std::function<std::filesystem::path(size_t)>& file_of, bool is_display) const {
    Json images = Json::array();
    Size size;
    for (const size_t index : indices_) {
        Reference how = references_[index];
        if (is_display) how.color_space = ColorSpace::srgb;
        const std::filesystem::path file = file_of(index);
        const auto encode = [&] {
            const io::Pixels pixels = read_display(file, how);
            return PictureCache::Picture{pixels.size, data_url(name_, pixels)};
        };
        const PictureCache::Picture picture = cache_ ? cache_->find(key_of(file, how.color_space), encode) : encode();
        size = picture.size;
        images.push_back(picture.url);
    }
    return {{"name", name}, {"kind", kind}, {"size", {size.width, size.height}}, {"images", std::move(images)}};
}

void MaskPictures::add(size_t frame, const metrics::Masks& masks) {
    if (std::ranges::find(pictured_, frame) == pictured_.end()) return;
    for (size_t i = 0; i < metrics::region_count; ++i) {
        const metrics::Mask& mask = masks.masks[i];
        has_pixels_[i] = has_pixels_[i] || std::ranges::count(mask, 1) > 0;
        images_[i].push_back(data_url("mask.png", {size_, 1, {mask.begin(), mask.end()}}));
    }
}

Json MaskPictures::json() const {
    Json masks = Json::array();
    for (size_t i = 0; i < metrics::region_count; ++i)
        if (has_pixels_[i] && images_[i].size() == pictured_.size())
            masks.push_back({{"name", metrics::region_names[i]}, {"images", images_[i]}});
    return masks;
}

Json worst_places(const ComparedResult& result, std::span<const size_t> pictured) {
    struct Place {
        size_t picture;
        int x, y;
        double error;
    };
    std::vector<Place> places;
    for (size_t i = 0; i < pictured.size(); ++i) {
        if (pictured[i] >= result.frames.size()) continue;
        const metrics::BlockErrors& blocks = result.frames[pictured[i]].blocks;
        for (size_t k = 0; k < blocks.mean_squared_errors.size(); ++k) {
            const int index = static_cast<int>(k), side = metrics::BlockErrors::side;
            places.push_back(
                {i, index % blocks.grid.width * side, index / blocks.grid.width * side, blocks.mean_squared_errors[k]});
        }
    }
    std::ranges::stable_sort(places, std::greater(), &Place::error);
    places.resize(std::min(places.size(), most_places));
    Json json = Json::array();
    for (const auto& [picture, x, y, error] : places)
        json.push_back({{"picture", picture}, {"x", x}, {"y", y}, {"psnr", metrics::psnr(error)}});
    return json;
}

}  // namespace clarus::cli
