#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "runtime/tuner.h"

namespace clarus::runtime {

/// A file of `runtime/tuned/`, as it was when the library was built.
struct TunedFile {
    std::string_view name;  // "cpu.json"
    std::string_view text;
};
std::span<const TunedFile> tuned_files();

/// What a tuner measured on one device, as a suggestion for others of its class: a tuner's file under
/// cache_directory(). What was found at one size, the largest, serves all: a choice that changed with the size would
/// have other sizes compile other programs.
class TunedTable {
  public:
    /// Errors: file, with `name`, where the text is no such file or an entry is not one of a tuner's.
    TunedTable(std::string_view name, std::string_view text);

    /// What was faster than the built-in choice by more than measuring errors, where the device can run it.
    std::optional<Selection> find(const Problem& problem, const DeviceProfile& profile) const;

    /// By key_of().
    const TuningResults& results() const { return results_; }
    static std::string key_of(const Problem& problem, const DeviceProfile& profile);

    /// The shipped one, or null.
    static const TunedTable* of(DeviceClass device_class);

  private:
    TuningResults results_;
};

}  // namespace clarus::runtime
