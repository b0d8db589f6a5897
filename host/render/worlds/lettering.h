#pragma once

#include <OpenImageIO/imagebuf.h>

#include <array>
#include <memory>
#include <string>

#include "render/random.h"
#include "render/texture.h"

namespace clarus::render {

/// Words that a sign or a screen might say.
std::string invented_words(Random& random, int count);

/// A sign's face with writing on it, in these linear colours. Twice as wide as high.
std::shared_ptr<const Texture> invented_sign(Random& random, const Imath::V3f& ground, const Imath::V3f& ink);

/// Writes with the left end of the baseline at (x, y), `size` pixels high; four channels. Errors: file where no font of
/// fonts-dejavu-core is there.
void write_text(OIIO::ImageBuf& image, int x, int y, int size, const std::string& text,
                const std::array<float, 4>& ink);

}  // namespace clarus::render
