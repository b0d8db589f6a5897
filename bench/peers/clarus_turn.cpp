// One of the processes that take turns (README.md): runs frames of a model when told to.
//
//   clarus_turn DEVICE PRECISION MODEL WIDTH HEIGHT JITTER_X JITTER_Y FOLDER
//
// FOLDER holds the frame's color.f32, depth.f32 and motion.f32: rows of interleaved floats. Answers are JSON, a line
// each: one at the start, then one a command read from standard input. "check" runs the frame twice, the first time as
// a reset, and writes the second output to FOLDER/clarus.f32; "frame" runs it once more.

#include <fmt/format.h>

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/error.h"
#include "cl/context.h"
#include "clarus/upscaler.h"

namespace clarus::bench {
namespace {

/// An image in this program's memory, used by the device without a copy where it shares memory with the host.
class SharedImage {
  public:
    SharedImage(const Device& device, Size size, int channels)
        : size_(size), pixels_(static_cast<size_t>(size.width) * size.height * channels) {
        buffer_ =
            cl::Buffer(device.context().context(), CL_MEM_READ_WRITE | CL_MEM_USE_HOST_PTR, bytes(), pixels_.data());
    }

    Image image() const { return {.buffer = buffer_(), .size = size_}; }

    void read_file(const Device& device, const std::string& path) {
        std::ifstream file(path, std::ios::binary);
        std::vector<float> values(pixels_.size());
        if (!file.read(reinterpret_cast<char*>(values.data()), static_cast<std::streamsize>(bytes())))
            fail(ErrorKind::file, "{}: cannot read {} bytes", path, bytes());
        device.context().queue().enqueueWriteBuffer(buffer_, CL_TRUE, 0, bytes(), values.data());
    }

    void write_file(const Device& device, const std::string& path) const {
        std::vector<float> values(pixels_.size());
        device.context().queue().enqueueReadBuffer(buffer_, CL_TRUE, 0, bytes(), values.data());
        std::ofstream file(path, std::ios::binary);
        if (!file.write(reinterpret_cast<const char*>(values.data()), static_cast<std::streamsize>(bytes())))
            fail(ErrorKind::file, "{}: cannot write", path);
    }

  private:
    size_t bytes() const { return pixels_.size() * sizeof(float); }

    Size size_;
    std::vector<float> pixels_;
    cl::Buffer buffer_;
};

UpscalerOptions profiled(const std::string& precision, const Device& device) {
    UpscalerOptions options;
    options.profile = true;
    if (precision != "fp32" && precision != "bf16")
        fail(ErrorKind::invalid_argument, "{} is neither fp32 nor bf16", precision);
    if (precision == "bf16" && !device.profile().bf16)
        fail(ErrorKind::invalid_argument, "{} does not multiply bfloat16", device.profile().name);
    if (precision == "bf16") options.precision = Precision::bf16;
    return options;
}

class Turn {
  public:
    Turn(const Device& device, const UpscalerOptions& options, const Model& model, Size render, Vec2 jitter,
         const std::string& folder)
        : device_(device),
          folder_(folder),
          upscaler_(device, model, render, options),
          color_(device, render, 3),
          depth_(device, render, 1),
          motion_(device, render, 2),
          output_(device, upscaler_.output_size(), 3) {
        upscaler_.prepare();
        color_.read_file(device, folder + "/color.f32");
        depth_.read_file(device, folder + "/depth.f32");
        motion_.read_file(device, folder + "/motion.f32");
        frame_.color = color_.image();
        frame_.depth = depth_.image();
        frame_.motion = motion_.image();
        frame_.jitter = jitter;
        frame_.output = output_.image();
    }

    nlohmann::json check() {
        frame_.reset = true;
        upscaler_.submit(frame_).wait();
        frame_.reset = false;
        upscaler_.submit(frame_).wait();
        output_.write_file(device_, folder_ + "/clarus.f32");
        return nlohmann::json::object();
    }

    /// Seconds of the host's clock, and of every stage by the device's.
    nlohmann::json run() {
        upscaler_.take_profile();
        const auto start = std::chrono::steady_clock::now();
        upscaler_.submit(frame_).wait();
        const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
        nlohmann::json stages = nlohmann::json::array();
        for (const StageProfile& stage : upscaler_.take_profile())
            stages.push_back({{"name", stage.name}, {"kernel", stage.kernel}, {"seconds", stage.seconds}});
        return {{"seconds", seconds.count()}, {"stages", std::move(stages)}};
    }

  private:
    const Device& device_;
    std::string folder_;
    Upscaler upscaler_;
    SharedImage color_, depth_, motion_, output_;
    FrameDescription frame_;
};

int run(const std::vector<std::string>& arguments) {
    if (arguments.size() != 8)
        fail(ErrorKind::invalid_argument,
             "usage: clarus_turn DEVICE PRECISION MODEL WIDTH HEIGHT JITTER_X JITTER_Y FOLDER");
    const Device device = Device::open(arguments[0]);
    const Size render{std::stoi(arguments[3]), std::stoi(arguments[4])};
    const Vec2 jitter{std::stof(arguments[5]), std::stof(arguments[6])};
    Turn turn(device, profiled(arguments[1], device), Model::find(arguments[2]), render, jitter, arguments[7]);
    const DeviceProfile& profile = device.profile();
    const auto say = [](const nlohmann::json& answer) { std::cout << answer.dump() << std::endl; };
    say({{"device", profile.name}, {"version", profile.opencl_version}, {"threads", profile.compute_units}});
    for (std::string command; std::getline(std::cin, command);) say(command == "check" ? turn.check() : turn.run());
    return EXIT_SUCCESS;
}

}  // namespace
}  // namespace clarus::bench

int main(int argc, char** argv) {
    try {
        return clarus::bench::run({argv + 1, argv + argc});
    } catch (const std::exception& error) {
        fmt::print(stderr, "clarus_turn: {}\n", error.what());
        return EXIT_FAILURE;
    }
}
