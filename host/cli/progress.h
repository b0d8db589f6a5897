#pragma once

#include <chrono>
#include <cstddef>
#include <string>

namespace clarus::cli {

/// A line on stderr with a bar and an estimate of what is left. Shown only on a terminal, and only once the work has
/// taken two seconds; erased when done.
class Progress {
  public:
    explicit Progress(std::string label);
    ~Progress();
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;

    /// `fraction` of the work is done, 0…1.
    void update(double fraction);
    void update(size_t done, size_t total) { update(total ? static_cast<double>(done) / total : 1.0); }

  private:
    using Clock = std::chrono::steady_clock;

    std::string label_;
    Clock::time_point start_ = Clock::now();
    Clock::time_point drawn_ = start_;
    bool terminal_;
    bool visible_ = false;
};

}  // namespace clarus::cli
