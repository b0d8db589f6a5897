// A device of two that fails, in a call or later: what is said, and how the other goes on.

#include <doctest/doctest.h>

#include <string>
#include <vector>

#include "clarus/error.h"
#include "loaded_layer.h"
#include "several_devices.h"

using namespace clarus;
using namespace clarus::test;

namespace {

/// What a fallback leaves: the same frames, of which `again` begins without history.
Images without_history_at(Film& film, Upscaler& upscaler, int again) {
    Images outputs(film.golden.frames);
    for (int number = 0; number < film.golden.frames; ++number) {
        FrameDescription frame = film.frame(number, upscaler, outputs[number]);
        frame.reset = frame.reset || number == again;
        upscaler.submit(frame).wait();
    }
    return outputs;
}

constexpr const char* kCut = "*convolution*=1";

}  // namespace

TEST_CASE("the loss of a device is an error that names it") {
    const Faults faults;
    const Device devices = of_two_contexts();
    const test::Golden golden("mnss_x2_checked");
    Film film(golden);
    Upscaler upscaler(devices, golden.model, golden.render, options_for(golden, kCut));
    std::vector<float> output;
    upscaler.submit(film.frame(0, upscaler, output)).wait();
    SUBCASE("as it is given work") {
        faults.fail_kernels(devices, 1, 0);
        CHECK_THROWS_WITH_AS(upscaler.submit(film.frame(1, upscaler, output)), doctest::Contains("device 1, "), Error);
    }
    SUBCASE("later") {
        faults.fail_markers(devices, 1, 0);
        CHECK_THROWS_WITH_AS(upscaler.submit(film.frame(1, upscaler, output)).wait(), doctest::Contains("device 1, "),
                             Error);
    }
}

TEST_CASE("with a fallback, what a lost device made moves to the other, and the history is dropped") {
    const test::Golden golden("mnss_x2_checked");
    REQUIRE(golden.frames >= 3);
    Film film(golden);
    constexpr int kLost = 2;  // the frame
    Upscaler alone(test_device(), golden.model, golden.render, options_for(golden));
    const Images expected = without_history_at(film, alone, kLost), uninterrupted = film.run(alone);
    for (const int device : {0, 1}) {
        for (const char* const rules : {kCut, "*=1", ""}) {
            const bool has_work = !(device == 0 && rules == std::string("*=1")) && !(device == 1 && !*rules);
            CAPTURE(device);
            CAPTURE(std::string(rules));
            const Faults
                faults;  // of one placement's devices: another's context may get the address of one that is gone
            const Device devices = of_two_contexts();
            UpscalerOptions options = options_for(golden, rules);
            options.fallback = true;
            Upscaler upscaler(devices, golden.model, golden.render, options);
            Images outputs(golden.frames);
            for (int number = 0; number < golden.frames; ++number) {
                if (number == kLost) faults.fail_kernels(devices, device, 1);
                upscaler.submit(film.frame(number, upscaler, outputs[number])).wait();
            }
            CHECK(outputs == (has_work ? expected : uninterrupted));
            for (const PlacedPart& part : upscaler.placement()) CHECK((part.device != device || !has_work));
        }
    }
}

TEST_CASE("a frame that a lost device had is submitted again") {
    const test::Golden golden("mnss_x2_checked");
    Film film(golden);
    constexpr int kLost = 2;
    Upscaler alone(test_device(), golden.model, golden.render, options_for(golden));
    const Images expected = without_history_at(film, alone, kLost);
    const Faults faults;
    const Device devices = of_two_contexts();
    UpscalerOptions options = options_for(golden, kCut);
    options.fallback = true;
    Upscaler upscaler(devices, golden.model, golden.render, options);
    Images outputs(golden.frames);
    for (int number = 0; number < golden.frames; ++number) {
        if (number == kLost) faults.fail_markers(devices, 1, 0);
        const FrameDescription frame = film.frame(number, upscaler, outputs[number]);
        const FrameEvent event = upscaler.submit(frame);
        if (number == kLost) {
            CHECK_THROWS_AS(event.wait(), Error);
            upscaler.submit(frame).wait();
        } else {
            event.wait();
        }
    }
    CHECK(outputs == expected);
}

TEST_CASE("where all devices are lost, that is an error, and a fallback needs two") {
    const test::Golden golden("srpo_x2");
    Film film(golden);
    const Faults faults;
    const Device devices = of_two_contexts();
    UpscalerOptions options = options_for(golden, kCut);
    options.fallback = true;
    Upscaler upscaler(devices, golden.model, golden.render, options);
    std::vector<float> output;
    upscaler.submit(film.frame(0, upscaler, output)).wait();
    faults.fail_kernels(devices, 1, 0);
    upscaler.submit(film.frame(0, upscaler, output)).wait();
    faults.fail_kernels(devices, 0, 0);
    CHECK_THROWS_WITH_AS(upscaler.submit(film.frame(0, upscaler, output)), doctest::Contains("device 0, "), Error);

    options.placement = "auto";
    CHECK_THROWS_WITH_AS(Upscaler(test_device(), golden.model, golden.render, options), doctest::Contains("fallback"),
                         Error);
}
