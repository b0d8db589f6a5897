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
        frame.color = {color.data(), nullptr, nullptr, 0, 0, kWidth, kHeight, 0, 0};
        frame.output = {output.data(), nullptr, nullptr, 0, 0, 2 * kWidth, 2 * kHeight, 0, 0};
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
    refused([](clarus_options& options) { options.precision = static_cast<clarus_precision>(4); }, "precision");
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
    bicubic.refuses(with_output(image()), "but an image object");
}

TEST_CASE("C: an image object of another kind, format or size is refused") {
    if (!test_device().profile().images) return;
    clarus_options options = clarus_default_options();
    options.color_format.channels = 4;
    Bicubic bicubic(&options);
    REQUIRE(bicubic.status == CLARUS_OK);
    const clarus::ocl::Context& context = test_device().context();
    const auto image = [&](cl_channel_order order, cl_channel_type type, size_t height) {
        return cl::Image2D(context.context(), CL_MEM_READ_WRITE, cl::ImageFormat(order, type), kWidth, height);
    };
    const auto refused = [&](cl_mem memory, const std::string& culprit, auto&& change) {
        clarus_frame frame = bicubic.frame();
        frame.color.host = nullptr;
        frame.color.image = memory;
        change(frame.color);
        bicubic.refuses(frame, culprit);
    };
    const auto as_it_is = [](clarus_image&) {};
    const cl::Image2D fits = image(CL_RGBA, CL_FLOAT, kHeight);
    refused(fits(), "row_pitch and offset", [](clarus_image& color) { color.row_pitch = 4096; });
    refused(fits(), "the image object is 8x6; 8x6 at (1, 0)", [](clarus_image& color) { color.origin_x = 1; });
    refused(fits(), "give one", [&](clarus_image& color) { color.buffer = fits(); });
    refused(image(CL_RGBA, CL_FLOAT, kHeight - 1)(), "8x6 at (0, 0)", as_it_is);
    refused(image(CL_RGBA, CL_HALF_FLOAT, kHeight)(), "4 channels of f16, the options' format has 4 of f32", as_it_is);
    refused(image(CL_RGBA, CL_SIGNED_INT32, kHeight)(), "type 0x10d9", as_it_is);
    refused(image(CL_BGRA, CL_UNORM_INT8, kHeight)(), "channel order is 0x10b6", as_it_is);
    const cl::Buffer buffer(context.context(), CL_MEM_READ_WRITE, kOutputBytes);
    refused(buffer(), "but a buffer", as_it_is);
    const cl::Image3D volume(context.context(), CL_MEM_READ_WRITE, cl::ImageFormat(CL_RGBA, CL_FLOAT), 8, 8, 8);
    refused(volume(), "another kind of image object", as_it_is);
    const cl::Context elsewhere(context.device());
    const cl::Image2D foreign(elsewhere, CL_MEM_READ_WRITE, cl::ImageFormat(CL_RGBA, CL_FLOAT), kWidth, kHeight);
    refused(foreign(), "not a 2D image object of the upscaler's context", as_it_is);

    clarus_frame frame = bicubic.frame();
    frame.color.host = nullptr;
    frame.color.image = fits();
    const cl_float4 grey{{0.25f, 0.25f, 0.25f, 1}};
    context.queue().enqueueFillImage(fits, grey, {0, 0, 0}, {kWidth, kHeight, 1});
    context.queue().finish();
    REQUIRE(clarus_upscaler_submit(bicubic.upscaler, &frame, nullptr) == CLARUS_OK);
    REQUIRE(clarus_upscaler_wait(bicubic.upscaler) == CLARUS_OK);
    CHECK(bicubic.output[5] == doctest::Approx(0.25));
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
