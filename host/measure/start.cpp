#include "measure/start.h"

#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/precision.h"
#include "base/private_files.h"
#include "base/rounding.h"
#include "cl/disk_cache.h"
#include "clarus/jitter.h"
#include "io/temporary_folder.h"
#include "measure/child.h"
#include "measure/timed_upscaler.h"

namespace clarus::measure {
namespace {

namespace fs = std::filesystem;

/// Where Clarus and drivers (PoCL, NVIDIA's, Mesa's, Intel's, AMD's) are told to keep what they compile.
constexpr std::array kCacheVariables{"CLARUS_CACHE_DIR",      "XDG_CACHE_HOME", "POCL_CACHE_DIR",     "CUDA_CACHE_PATH",
                                     "MESA_SHADER_CACHE_DIR", "NEO_CACHE_DIR",  "AMD_COMGR_CACHE_DIR"};

fs::path clarus_cache(const fs::path& caches) { return caches / kCacheVariables.front(); }

std::vector<std::string> environment(const fs::path& caches) {
    std::vector<std::string> result;
    for (char** variable = environ; *variable; ++variable) {
        const std::string_view text = *variable;
        const std::string_view name = text.substr(0, text.find('='));
        if (std::find(kCacheVariables.begin(), kCacheVariables.end(), name) == kCacheVariables.end())
            result.emplace_back(text);
    }
    for (const char* name : kCacheVariables) {
        fs::create_directories(caches / name);
        result.push_back(fmt::format("{}={}", name, (caches / name).string()));
    }
    return result;
}

struct Outcome {
    double seconds;  // to the first frame
    int programs;
};

Outcome run(std::vector<std::string> arguments, std::vector<std::string> variables) {
    const double start = now();
    Child process(std::move(arguments), std::move(variables));
    Outcome outcome{0, 0};
    while (const std::optional<std::string> line = process.hear())
        if (outcome.seconds == 0 && line->starts_with(kFirstFrameWord))
            outcome = {now() - start, std::atoi(line->c_str() + std::strlen(kFirstFrameWord))};
    if (process.wait() != 0 || outcome.seconds == 0)
        fail(ErrorKind::device, "a new process came to no first frame: {}", process.last_words());
    return outcome;
}

/// What is there already stays.
void add_files(const fs::path& from, const fs::path& to) {
    if (!fs::exists(from)) return;
    std::error_code unwritable;  // then nothing is kept
    if (!make_private_folder(to)) return;
    fs::copy(from, to, fs::copy_options::recursive | fs::copy_options::skip_existing, unwritable);
}

}  // namespace

Start measure_start(const fs::path& tool, const FirstFrame& first) {
    const io::TemporaryFolder folder;
    const std::vector<std::string> variables = environment(folder.path());
    const fs::path cache = clarus_cache(folder.path());
    // Kernels are those of the run that this is a part of.
    const fs::path kept = cache_directory();
    if (!kept.empty()) add_files(kept / "tuning", cache / "tuning");
    const auto start = [&](Size render_size) {
        return run({tool.string(), "bench", "first-frame", first.device, first.model, fmt::to_string(first.scale),
                    fmt::to_string(render_size.width), fmt::to_string(render_size.height), name_of(first.precision),
                    first.tuning == Tuning::fixed ? "fixed" : "stored"},
                   variables);
    };
    const Outcome cold = start(first.render_size), warm = start(first.render_size);
    if (!kept.empty()) add_files(cache / ocl::programs_directory().filename(), ocl::programs_directory());
    // A game's next choice when its frames take too long.
    const Outcome other =
        start({ceil_divide(3 * first.render_size.width, 4), ceil_divide(3 * first.render_size.height, 4)});
    return {cold.seconds, warm.seconds, cold.programs, other.seconds, other.programs};
}

int show_first_frame(const FirstFrame& first) {
    const Device device = Device::open(first.device);
    UpscalerOptions options;
    options.precision = first.precision;
    options.tuning = first.tuning;
    Upscaler upscaler(device, Model::find(first.model, first.scale), first.render_size, options);
    const Size size = upscaler.output_size();
    // Grey, still and flat: the test sequence's frames would take longer to make than to upscale.
    const size_t pixels = static_cast<size_t>(first.render_size.width) * first.render_size.height;
    std::vector<float> color(3 * pixels, 0.5f), depth(pixels, 0.5f), motion(2 * pixels);
    std::vector<float> output(size_t{3} * size.width * size.height);
    FrameDescription description;
    description.color = {.host = color.data(), .size = first.render_size};
    description.depth = {.host = depth.data(), .size = first.render_size};
    description.motion = {.host = motion.data(), .size = first.render_size};
    description.output = {.host = output.data(), .size = size};
    description.jitter = halton_jitter(0, 16);
    upscaler.submit(description).wait();
    return device.programs_compiled();
}

}  // namespace clarus::measure
