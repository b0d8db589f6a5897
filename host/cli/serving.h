#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "clarus/upscaler.h"
#include "cli/frame_source.h"
#include "cli/model_choice.h"
#include "cli/shared_source.h"

namespace clarus::cli {

/// What `clarus serve` upscales with, and may be told to upscale with instead. It changes between two frames: the next
/// upscaler is prepared beside the one that runs, on the same device with a queue of its own.
class Serving {
  public:
    using Progress = std::function<void(double)>;  // 0…1

    struct Settings {
        ModelWish wish;
        std::string device;             // a selector
        UpscalerOptions upscaler;       // but for what the stream says
        bool keeps_size = false;        // the output is as large as the first stream's, for it goes where no other can
        std::optional<Size> only_size;  // that
    };

    /// `source` outlives it. Errors: those of find_model and Device::open.
    Serving(std::string name, const SharedSource& source, Settings settings);

    /// Prepares for the stream that the source has connected to. Errors: those of choose_model, Upscaler and
    /// Device::open; invalid_argument where the stream lacks what the model needs, or is in another colour space than
    /// those before it.
    void meet(const Progress& progress);

    /// What upscales this frame of the source's stream. Errors: as meet.
    std::shared_ptr<Upscaler> choose(SourceFrame& frame);

    /// From another thread: `changes` may have "model", "scale" and "output-size", as text; the last two may be "auto".
    /// Returns once what is asked for is prepared: it has the next frame. Errors: as meet, naming what cannot be; all
    /// stays as it was.
    void change(const nlohmann::json& changes, const Progress& progress);
    /// State and figures. From another thread.
    nlohmann::json state() const;

    const Upscaler& upscaler() const;

  private:
    struct Seat;

    std::shared_ptr<Seat> prepare(const Settings& settings, std::shared_ptr<const SharedStream> stream,
                                  const Progress& progress) const;

    std::string name_;
    const SharedSource& source_;
    Device device_;             // of all upscalers, so that a model that comes back finds its programs
    mutable std::mutex mutex_;  // guards what follows
    Settings settings_;         // of what runs last: next_, or else current_
    std::shared_ptr<const SharedStream> stream_;
    std::shared_ptr<Seat> current_, next_;
    int changes_ = 0;
};

}  // namespace clarus::cli
