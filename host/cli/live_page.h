#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/comparison.h"
#include "cli/report_pictures.h"
#include "report/server.h"

namespace clarus::cli {

/// The report's page of result folders that may still grow: made again where they have changed. It has the frames of
/// which every folder has the picture.
class LivePage {
  public:
    struct Settings {
        std::vector<std::filesystem::path> results;  // at least one
        ReferenceOptions reference;  // `sequence.path` empty: pictures alone, of the first result's names
        size_t pictures = 8;         // at most, from 2 on
        bool lossless = false;
        std::string title;  // empty: the sequence's name, or the first result's
    };

    /// Reads the sequence and makes the page of what there is. Errors: file, where a folder is missing or something in
    /// it cannot be read; those of read_frames.
    explicit LivePage(Settings settings);

    /// Looks at the folders where somebody has asked since the last time, and makes the page anew where they have
    /// changed. Figures follow the pictures: a second of measuring at a time. What goes wrong is a warning, once, and
    /// the page stays as it was.
    void update();

    /// For the server: any thread.
    std::shared_ptr<const report::ServedPage> page();

    size_t frames() const { return shown_.size(); }

  private:
    using Clock = std::chrono::steady_clock;

    void look();
    void measure();
    void publish();
    bool is_measured() const { return !comparison_ || comparison_->measured() == shown_.size(); }
    nlohmann::ordered_json data();
    void add_results(nlohmann::ordered_json& data);
    void add_views(const Pictures& pictures, nlohmann::ordered_json& sources) const;

    Settings settings_;
    std::vector<std::string> names_;     // of the results
    std::vector<Reference> references_;  // all frames that there may be; without a sequence, those seen last
    bool has_references_ = false;
    std::vector<Reference> shown_;                              // of which all results have the picture
    std::vector<std::string> stamps_;                           // of the pictures of these
    std::vector<std::vector<std::filesystem::path>> pictures_;  // of the results, of these
    std::string state_, published_;           // of the folders, as it was seen and as it was published
    std::unique_ptr<Comparison> comparison_;  // where there are references
    size_t published_measured_ = 0;
    Clock::time_point published_at_{};
    PictureCache cache_;
    std::string last_warning_;
    std::atomic<bool> is_asked_ = false;
    std::mutex mutex_;  // of the page
    std::shared_ptr<const report::ServedPage> page_;
};

}  // namespace clarus::cli
