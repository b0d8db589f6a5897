#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string_view>

#include "runtime/tuner.h"

namespace clarus::runtime {

/// What a tuner's file says of one problem. Errors: file, naming `file`; also nlohmann's, which do not.
TuningResult read_result(const nlohmann::json& entry, std::string_view file);

/// What a tuner's file of this text says. Errors: file, naming `file`, where it is none.
TuningResults read_results(std::string_view text, std::string_view file);

}  // namespace clarus::runtime
