#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "render/worlds/model_file.h"
#include "render/worlds/shots.h"

namespace clarus::render {

/// A TORCS track's middle line, in the coordinates of its model.
class Track {
  public:
    /// `pieces` are those of the track's model. Errors: file where the line does not close or does not lie on the
    /// model.
    Track(const std::filesystem::path& description, const std::vector<Piece>& pieces);

    double length() const { return static_cast<double>(middle_.size()); }
    double width() const { return width_; }
    /// Parallel to the middle line, on the road; to the right by `offset` metres; as long as the middle line is.
    Way lane(double offset) const;

  private:
    std::vector<Imath::V2d> middle_;  // x and z, a point a metre, closed
    double width_ = 0;
    std::shared_ptr<const Scene> road_;
};

/// The file of the model that a track's description names.
std::string track_model(const std::filesystem::path& description);

}  // namespace clarus::render
