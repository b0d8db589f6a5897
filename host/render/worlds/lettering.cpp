#include "render/worlds/lettering.h"

#include <OpenImageIO/imagebufalgo.h>

#include <algorithm>

#include "base/error.h"

namespace clarus::render {

using Imath::V3f;

std::string invented_words(Random& random, int count) {
    constexpr std::array openings = {"b", "d", "f", "g", "k", "l", "m", "n", "p", "r", "s", "t", "v", "br", "st", "tr"};
    constexpr std::array middles = {"a", "e", "i", "o", "u", "ai", "ou", "ea"};
    constexpr std::array ends = {"", "n", "r", "s", "l", "x", "nd", "rt"};
    const auto one_of = [&](const auto& list) {
        return list[static_cast<size_t>(random.below(static_cast<int>(list.size())))];
    };
    std::string words;
    for (int word = 0; word < count; ++word) {
        if (word > 0) words += ' ';
        if (random.below(6) == 0) {
            words += std::to_string(random.below(1000));
            continue;
        }
        std::string letters;
        for (int syllable = 1 + random.below(3); syllable > 0; --syllable) {
            letters += one_of(openings);
            letters += one_of(middles);
            letters += one_of(ends);
        }
        const bool shouted = random.below(3) == 0;
        for (size_t i = 0; i < (shouted ? letters.size() : 1); ++i)
            letters[i] = static_cast<char>(letters[i] - 'a' + 'A');
        words += letters;
    }
    return words;
}

void write_text(OIIO::ImageBuf& image, int x, int y, int size, const std::string& text,
                const std::array<float, 4>& ink) {
    if (!OIIO::ImageBufAlgo::render_text(image, x, y, text, size, "DejaVuSans", ink)) {
        fail(ErrorKind::file,
             "cannot write text into a picture: {}; the font comes with: apt-get install fonts-dejavu-core",
             image.geterror());
    }
}

std::shared_ptr<const Texture> invented_sign(Random& random, const V3f& ground, const V3f& ink) {
    constexpr int log2_width = 9, log2_height = 8, width = 1 << log2_width, height = 1 << log2_height;
    OIIO::ImageBuf image(OIIO::ImageSpec(width, height, 4, OIIO::TypeDesc::FLOAT));
    const std::array<float, 4> paper = {ground.x, ground.y, ground.z, 1}, letters = {ink.x, ink.y, ink.z, 1};
    OIIO::ImageBufAlgo::fill(image, letters);
    const int border = random.below(10);
    OIIO::ImageBufAlgo::fill(image, paper, OIIO::ROI(border, width - border, border, height - border));
    const int lines = 1 + random.below(7), line_height = (height - 2 * border) / lines;
    for (int line = 0; line < lines; ++line) {
        const std::string words = invented_words(random, 1 + lines / 2);
        // A letter is about 0.65 of its size wide.
        const int widest = (width - 2 * border - 20) * 3 / 2 / static_cast<int>(words.size());
        const int size = std::max(9, std::min(widest, line_height * (50 + random.below(30)) / 100));
        write_text(image, border + 6 + random.below(10), border + line_height * line + line_height * 3 / 4, size, words,
                   letters);
    }
    std::vector<Rgba> texels(static_cast<size_t>(width) * height);
    image.get_pixels(OIIO::ROI::All(), OIIO::TypeDesc::FLOAT, texels.data());
    return std::make_shared<Texture>(log2_width, log2_height, std::move(texels));
}

}  // namespace clarus::render
