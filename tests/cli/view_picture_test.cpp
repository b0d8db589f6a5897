#include "cli/view_picture.h"

#include <doctest/doctest.h>

#include <vector>

using namespace clarus;

namespace {

/// Channel c of every pixel is c + 1.
Upscaler::View numbered(int channels, bool maps) {
    Upscaler::View view{{4, 4}, channels, {}, maps};
    for (int pixel = 0; pixel < 16; ++pixel)
        for (int channel = 0; channel < channels; ++channel) view.pixels.push_back(static_cast<float>(channel + 1));
    return view;
}

}  // namespace

TEST_SUITE("small") {
    TEST_CASE("maps are pictures of their own in grey, also two or three of them") {
        for (const int channels : {2, 3, 4}) {
            CAPTURE(channels);
            const io::Pixels picture = cli::view_picture(numbered(channels, true), {8, 8});
            const auto is_grey = [&](int x, int y, float value) {
                for (int channel = 0; channel < 3; ++channel)
                    CHECK(picture.at(x, y, channel) == doctest::Approx(value));
            };
            const auto most = static_cast<float>(channels);
            const int bottom = channels == 2 ? 0 : 4;  // two lie beside each other, more in two rows
            is_grey(0, 0, 1 / most);
            is_grey(4, 0, 2 / most);
            if (channels > 2) is_grey(0, bottom, 3 / most);
            if (channels > 3) is_grey(4, bottom, 1);
        }
    }

    TEST_CASE("three channels that are not maps are a colour, one map is a whole picture") {
        CHECK(cli::view_picture(numbered(3, false), {4, 4}).at(0, 0, 2) == 3);
        CHECK(cli::view_picture(numbered(1, true), {8, 8}).at(7, 7, 1) == 1);
    }

    TEST_CASE("a view that is smaller than the picture by no whole ratio is shown to its borders") {
        Upscaler::View view = numbered(1, true);
        view.pixels.assign(16, 0);
        view.pixels.back() = 1;
        CHECK(cli::view_picture(view, {6, 6}).at(5, 5, 0) == 1);
        CHECK(cli::view_picture(view, {6, 6}).at(3, 3, 0) == 0);
    }
}
