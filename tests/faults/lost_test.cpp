// A device that is lost in the middle of a frame, at each of the calls that the frame makes, and opened anew.

#include <doctest/doctest.h>

#include <optional>
#include <string>
#include <vector>

#include "clarus/error.h"
#include "loaded_layer.h"
#include "several_devices.h"

using namespace clarus;
using namespace clarus::test;

namespace {

/// The error of a frame; none where it ends well.
std::optional<Error> error_of(Upscaler& upscaler, const FrameDescription& frame) {
    try {
        upscaler.submit(frame).wait();
    } catch (const Error& error) {
        return error;
    }
    return std::nullopt;
}

}  // namespace

TEST_CASE("a device that is lost in mid-frame is an error that says so, and is opened anew in the same process") {
    const test::Golden golden("mnss_x2_checked");
    Film film(golden);
    Upscaler first(test_device(), golden.model, golden.render, options_for(golden));
    const Images expected = film.run(first);

    bool ends_well = false;
    int calls = 0;
    for (; !ends_well && calls < 1000; ++calls) {
        CAPTURE(calls);
        const Faults faults;
        const Device device = Device::open(test_selector());
        Upscaler upscaler(device, golden.model, golden.render, options_for(golden));
        std::vector<float> output;
        REQUIRE(!error_of(upscaler, film.frame(0, upscaler, output)).has_value());
        faults.lose(device, calls);
        const std::optional<Error> error = error_of(upscaler, film.frame(1, upscaler, output));
        ends_well = !error;
        if (ends_well) break;
        CHECK(error->kind() == ErrorKind::device);
        CHECK(std::string(error->what()).find(device.profile().name) == 0);
        CHECK(std::string(error->what()).find("lost") != std::string::npos);
        CHECK(std::string(error->what()).find("CL_DEVICE_NOT_AVAILABLE") != std::string::npos);
        CHECK(error_of(upscaler, film.frame(1, upscaler, output)).has_value());  // and remains so
        if (calls % 16 != 0) continue;

        const Device again = Device::open(test_selector());
        Upscaler other(again, golden.model, golden.render, options_for(golden));
        CHECK(film.run(other) == expected);
    }
    CHECK(ends_well);
    CHECK(calls > 20);  // a frame's
}
