#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "cli/comparison.h"
#include "metrics/masks.h"

namespace clarus::cli {

/// At most `most` of so many frames, evenly spaced, with the first and the last.
std::vector<size_t> evenly_spaced(size_t count, size_t most);

/// At most `most`, from 2 on, of frames that become more: the first, the last, and between them those that stay the
/// same ones for as long as they can.
std::vector<size_t> steadily_spaced(size_t count, size_t most);

/// Encoded pictures of files, for pages that are made again and again: what one page does not ask for, the next has
/// not.
class PictureCache {
  public:
    struct Picture {
        Size size;
        std::string url;
    };
    /// The picture of this key, made where it is not there.
    const Picture& find(const std::string& key, const std::function<Picture()>& make);
    /// Before the next page: lets go what was not asked for since the last time.
    void age();

  private:
    std::map<std::string, Picture> recent_, older_;
};

/// The page's pictures of some of a sequence's frames (report/page.h).
class Pictures {
  public:
    /// Of frames by their index. `references` and `cache`, which may be null, must outlive this.
    Pictures(std::span<const Reference> references, std::vector<size_t> indices, bool lossless,
             PictureCache* cache = nullptr);

    /// Of the pictured frames, into the references.
    const std::vector<size_t>& indices() const { return indices_; }

    /// One row of pictures, which the page may show on either side. `file_of`: that of a reference, by its index.
    /// `is_display`: it is a picture already, whatever the sequence's colours. Errors: those of read_display.
    nlohmann::ordered_json source(const std::string& name, const char* kind,
                                  const std::function<std::filesystem::path(size_t)>& file_of,
                                  bool is_display = false) const;

  private:
    std::span<const Reference> references_;
    std::vector<size_t> indices_;
    std::filesystem::path name_;
    PictureCache* cache_;
};

/// The masks of pictured frames, those of one kind together; white inside. Kinds without a pixel, or without a mask of
/// every pictured frame, are left out.
class MaskPictures {
  public:
    /// `pictured`, which must outlive this, are indices of frames; `size` is that of their images.
    MaskPictures(std::span<const size_t> pictured, Size size) : pictured_(pictured), size_(size) {}

    /// The next frame's, whether it is pictured or not.
    void add(size_t frame, const metrics::Masks& masks);

    nlohmann::ordered_json json() const;

  private:
    std::span<const size_t> pictured_;
    Size size_;
    std::array<std::vector<std::string>, metrics::region_count> images_;
    std::array<bool, metrics::region_count> has_pixels_{};
};

/// The blocks of pictured frames that are worst, from the worst on: {"picture": index into the pictured, "x", "y": of
/// the block's first pixel, "psnr"}. Frames that are not measured have none.
nlohmann::ordered_json worst_places(const ComparedResult& result, std::span<const size_t> pictured);

}  // namespace clarus::cli
