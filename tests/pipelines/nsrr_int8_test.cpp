#include <doctest/doctest.h>

#include "several_devices.h"

using namespace clarus;
using namespace clarus::test;

TEST_CASE("NSRR in whole numbers makes the same image in bands of rows, also on a DSP") {
    Golden golden("nsrr_x4");
    golden.model = Model::find("nsrr-fast-x4-int8");
    Film film(golden);
    for (const char* treated_as : {"", "=dsp"}) {
        CAPTURE(std::string(treated_as));
        const Device device = Device::open(test_selector() + treated_as);
        UpscalerOptions options = options_for(golden);
        Upscaler whole(device, golden.model, golden.render, options);
        const Images expected = film.run(whole);
        options.band_rows = 8;
        Upscaler banded(device, golden.model, golden.render, options);
        const Images images = film.run(banded);
        REQUIRE(images.size() == expected.size());
        for (size_t frame = 0; frame < images.size(); ++frame) CHECK(images[frame] == expected[frame]);
    }
}
