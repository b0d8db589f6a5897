#pragma once

#include <filesystem>

#include "io/image.h"
#include "io/output_layout.h"
#include "io/sequence.h"

namespace clarus::io {

/// docs/formats.md, "QRISP". `segment`: `<scene>/<540p|360p|270p>/MipBias…Jittered/<segment>`. Depth, motion and
/// reference are taken where their folders are. Errors: file.
Sequence read_qrisp(const std::filesystem::path& segment);

/// Whether the path has that form.
bool looks_like_qrisp(const std::filesystem::path& segment);

/// `segment` as above; errors: invalid_argument where it has another form.
std::unique_ptr<OutputLayout> qrisp_output(const std::filesystem::path& segment);

/// Depth of QRISP's 8-bit RGBA pixels: r/255 + g/255² + b/255³ + a/255⁴, one channel.
Pixels unpack_depth(const Pixels& packed);
/// The other way round, for values in [0, 1].
Pixels pack_depth(const Pixels& depth);

}  // namespace clarus::io
