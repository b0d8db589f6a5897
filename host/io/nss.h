#pragma once

#include <filesystem>

#include "io/sequence.h"

namespace clarus::io {

/// formats.md, "NSS capture". `description`: `<dataset>/<sequence>.json`; `scale` names the folder of the inputs (2:
/// `x2`, 1.5: `x1_5`) and the jitter's index. The reference is taken where its folder is. Errors: file.
Sequence read_nss(const std::filesystem::path& description, double scale);

}  // namespace clarus::io
