#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "cl/context.h"
#include "clarus/clarus.h"
#include "test_device.h"

namespace {

constexpr int kWidth = 8, kHeight = 6;
constexpr size_t kColorBytes = sizeof(float) * 3 * kWidth * kHeight, kOutputBytes = 4 * kColorBytes;

/// Bicubic, for frames on the device that is tested.
class Bicubic {
  public:
    explicit Bicubic(const clarus_options* options = nullptr) {
        clarus::ocl::Context& context = test_device().context();
        REQUIRE(clarus_device_adopt(context.context()(), context.device()(), context.queue()(), &device) == CLARUS_OK);
        REQUIRE(clarus_model_find("bicubic", 2, &model) == CLARUS_OK);
        status = clarus_upscaler_create(device, model, kWidth, kHeight, options, &upscaler);
    }
    ~Bicubic() {
        clarus_upscaler_release(upscaler);
        clarus_model_release(model);
        clarus_device_release(device);
    }
    Bicubic(const Bicubic&) = delete;
    Bicubic& operator=(const Bicubic&) = delete;

    clarus_frame frame() {
        clarus_frame frame = clarus_default_frame();
        frame.color = {color.data(), nullptr, 0, 0, kWidth, kHeight, 0, 0};
        frame.output = {output.data(), nullptr, 0, 0, 2 * kWidth, 2 * kHeight, 0, 0};
        return frame;
    }
    void refuses(const clarus_frame& frame, const std::string& culprit) {
        CHECK(clarus_upscaler_submit(upscaler, &frame, nullptr) == CLARUS_INVALID_ARGUMENT);
        CHECK_MESSAGE(std::string(clarus_last_error()).find(culprit) != std::string::npos, clarus_last_error());
    }

    clarus_device* device = nullptr;
    clarus_model* model = nullptr;
    clarus_upscaler* upscaler = nullptr;
    clarus_status status;
    std::vector<float> color = std::vector<float>(kColorBytes / sizeof(float), 0.5f);
    std::vector<float> output = std::vector<float>(kOutputBytes / sizeof(float));
};

}  // namespace

TEST_CASE("C: a null pointer is an error, or nothing happens") {
    Bicubic bicubic;
    REQUIRE(bicubic.status == CLARUS_OK);
    clarus_device* device = nullptr;
    clarus_model* model = nullptr;
    clarus_upscaler* upscaler = nullptr;
    clarus_interpolator* interpolator = nullptr;
    clarus_frame frame = bicubic.frame();
    int done = 0;

    CHECK(clarus_device_open(test_selector().c_str(), nullptr) == CLARUS_INVALID_ARGUMENT);
    CHECK(std::string(clarus_last_error()).find("device is NULL") != std::string::npos);
    CHECK(clarus_device_adopt(nullptr, nullptr, nullptr, &device) == CLARUS_INVALID_ARGUMENT);
    CHECK(clarus_device_together(nullptr, 2, &device) == CLARUS_INVALID_ARGUMENT);
    const clarus_device* const none[] = {bicubic.device, nullptr};
    CHECK(clarus_device_together(none, 2, &device) == CLARUS_INVALID_ARGUMENT);
    CHECK(clarus_device_together(none, 1, nullptr) == CLARUS_INVALID_ARGUMENT);
    CHECK(clarus_device_count(nullptr) == 0);
    CHECK(clarus_device_selector(nullptr, 0) == nullptr);
    CHECK(clarus_device_selector(bicubic.device, 1) == nullptr);
    CHECK(clarus_model_find(nullptr, 2, &model) == CLARUS_INVALID_ARGUMENT);
    CHECK(clarus_model_find("bicubic", 2, nullptr) == CLARUS_INVALID_ARGUMENT);
    CHECK(clarus_model_option_count(nullptr) == 0);
    CHECK(clarus_model_option(nullptr, 0).name == nullptr);
    CHECK(clarus_model_option(bicubic.model, 100).name == nullptr);
    double smallest = 1, largest = 1;
    clarus_model_scales(nullptr, &smallest, &largest);
    CHECK(largest == 0);
    clarus_model_scales(bicubic.model, nullptr, nullptr);
    CHECK(clarus_upscaler_create(nullptr, bicubic.model, 8, 6, nullptr, &upscaler) == CLARUS_INVALID_ARGUMENT);
    CHECK(clarus_upscaler_create(bicubic.device, nullptr, 8, 6, nullptr, &upscaler) == CLARUS_INVALID_ARGUMENT);
    CHECK(clarus_upscaler_create(bicubic.device, bicubic.model, 8, 6, nullptr, nullptr) == CLARUS_INVALID_ARGUMENT);
    int width = 1, height = 1;
    clarus_upscaler_output_size(nullptr, &width, &height);
    CHECK(width == 0);
    clarus_upscaler_output_size(bicubic.upscaler, nullptr, nullptr);
    CHECK(clarus_upscaler_output_size_of(nullptr, 8, 6, &width, &height) == CLARUS_INVALID_ARGUMENT);
    CHECK(clarus_upscaler_memory(nullptr).arena == 0);
    CHECK(clarus_upscaler_prepare(nullptr) == CLARUS_INVALID_ARGUMENT);
    CHECK(clarus_upscaler_submit(nullptr, &frame, nullptr) == CLARUS_INVALID_ARGUMENT);
    CHECK(clarus_upscaler_submit(bicubic.upscaler, nullptr, nullptr) == CLARUS_INVALID_ARGUMENT);
    CHECK(clarus_upscaler_wait(nullptr) == CLARUS_INVALID_ARGUMENT);
    CHECK(clarus_upscaler_wait_for(nullptr, 1, &done) == CLARUS_INVALID_ARGUMENT);
    CHECK(clarus_upscaler_wait_for(bicubic.upscaler, 1, nullptr) == CLARUS_INVALID_ARGUMENT);
    CHECK(clarus_upscaler_part_count(nullptr) == 0);
    CHECK(clarus_upscaler_part(bicubic.upscaler, 7).stages == nullptr);
    clarus_upscaler_reset(nullptr);
    clarus_upscaler_release(nullptr);
    CHECK(clarus_interpolator_create(nullptr, 8, 6, 8, 6, nullptr, &interpolator) == CLARUS_INVALID_ARGUMENT);
    CHECK(clarus_interpolator_create(bicubic.device, 8, 6, 8, 6, nullptr, nullptr) == CLARUS_INVALID_ARGUMENT);
    CHECK(clarus_interpolator_memory(nullptr).arena == 0);
    CHECK(clarus_interpolator_prepare(nullptr) == CLARUS_INVALID_ARGUMENT);
    CHECK(clarus_interpolator_submit(nullptr, &frame, nullptr) == CLARUS_INVALID_ARGUMENT);
    CHECK(clarus_interpolator_wait(nullptr) == CLARUS_INVALID_ARGUMENT);
    CHECK(clarus_interpolator_wait_for(nullptr, 1, &done) == CLARUS_INVALID_ARGUMENT);
    clarus_interpolator_reset(nullptr);

    frame.wait_for_count = 1;
    bicubic.refuses(frame, "frame.wait_for is NULL");
    const cl_event no_event = nullptr;
    frame.wait_for = &no_event;
    bicubic.refuses(frame, "frame.wait_for[0] is NULL");
}

TEST_CASE("C: values that mean nothing are refused where they are given") {
    const auto refused = [](auto&& change, const std::string& culprit) {
        clarus_options options = clarus_default_options();
        change(options);
        const Bicubic bicubic(&options);
        CHECK(bicubic.status == CLARUS_INVALID_ARGUMENT);
        CHECK_MESSAGE(std::string(clarus_last_error()).find(culprit) != std::string::npos, clarus_last_error());
    };
    refused([](clarus_options& options) { options.precision = static_cast<clarus_precision>(3); }, "precision");
    refused([](clarus_options& options) { options.tuning = static_cast<clarus_tuning>(4); }, "tuning");
    for (const int type : {7, 100})
        refused([&](clarus_options& options) { options.color_format.type = static_cast<clarus_element_type>(type); },
                "color_format");
    refused([](clarus_options& options) { options.output_format.type = static_cast<clarus_element_type>(9); },
            "output_format");
    refused([](clarus_options& options) { options.motion_scale_x = NAN; }, "motion.scale");
    refused([](clarus_options& options) { options.pipeline_option_count = 1; }, "pipeline_options is NULL");

    Bicubic bicubic;
    clarus_frame frame = bicubic.frame();
    frame.motion_scale_x = NAN;
    bicubic.refuses(frame, "frame.motion_scale");
    frame = bicubic.frame();
    frame.exposure = std::numeric_limits<float>::denorm_min();
    bicubic.refuses(frame, "frame.exposure");
}

TEST_CASE("C: what is no buffer, or cannot be written, is no output") {
    Bicubic bicubic;
    const clarus::ocl::Context& context = test_device().context();
    const auto with_output = [&](cl_mem memory) {
        clarus_frame frame = bicubic.frame();
        frame.output.host = nullptr;
        frame.output.buffer = memory;
        return frame;
    };
    const cl::Buffer read_only(context.context(), CL_MEM_READ_ONLY, kOutputBytes);
    bicubic.refuses(with_output(read_only()), "CL_MEM_READ_ONLY");
    clarus_frame frame = bicubic.frame();
    const cl::Buffer write_only(context.context(), CL_MEM_WRITE_ONLY, kColorBytes);
    frame.color.host = nullptr;
    frame.color.buffer = write_only();
    bicubic.refuses(frame, "CL_MEM_WRITE_ONLY");
    if (!test_device().profile().images) return;
    const cl::Image2D image(context.context(), CL_MEM_READ_WRITE, cl::ImageFormat(CL_RGBA, CL_FLOAT), 64, 64);
    bicubic.refuses(with_output(image()), "an image");
}

TEST_CASE("C: a wait for what never completes can end") {
    Bicubic bicubic;
    const clarus::ocl::Context& context = test_device().context();
    cl::UserEvent never(context.context());
    const cl_event event = never();
    clarus_frame frame = bicubic.frame();
    frame.wait_for = &event;
    frame.wait_for_count = 1;
    REQUIRE(clarus_upscaler_prepare(bicubic.upscaler) == CLARUS_OK);
    int done = 1;
    CHECK(clarus_upscaler_wait_for(bicubic.upscaler, 0, &done) == CLARUS_OK);
    CHECK(done == 1);  // nothing was submitted
    REQUIRE(clarus_upscaler_submit(bicubic.upscaler, &frame, nullptr) == CLARUS_OK);
    CHECK(clarus_upscaler_wait_for(bicubic.upscaler, 0.05, &done) == CLARUS_OK);
    CHECK(done == 0);
    CHECK(clarus_upscaler_wait_for(bicubic.upscaler, -1, &done) == CLARUS_INVALID_ARGUMENT);
    never.setStatus(CL_COMPLETE);
    CHECK(clarus_upscaler_wait_for(bicubic.upscaler, 60, &done) == CLARUS_OK);
    CHECK(done == 1);
    CHECK(bicubic.output[5] == doctest::Approx(0.5));
}
