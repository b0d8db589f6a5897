#pragma once

#include <filesystem>

#include "io/output_layout.h"
#include "io/sequence.h"

namespace clarus::io {

/// docs/formats.md, "NSS capture". `description`: `<dataset>/<sequence>.json`; `scale` names the folder of the inputs
/// (2: `x2`, 1.5: `x1_5`) and the jitter's index. The reference is taken where its folder is. Errors: file.
Sequence read_nss(const std::filesystem::path& description, double scale);

/// A capture of one ratio. `description` as above; errors: invalid_argument where it does not end in .json.
std::unique_ptr<OutputLayout> nss_output(const std::filesystem::path& description);

}  // namespace clarus::io
