#include "measure/start.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/precision.h"
#include "base/rounding.h"
#include "cl/disk_cache.h"
#include "clarus/jitter.h"
#include "io/temporary_folder.h"
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

std::vector<char*> pointers(std::vector<std::string>& texts) {
    std::vector<char*> result;
    for (std::string& text : texts) result.push_back(text.data());
    result.push_back(nullptr);
    return result;
}

struct Outcome {
    double seconds;  // to the first frame
    int programs;
};

/// The process's output comes through a pipe. It is waited for, whatever it says.
Outcome run(std::vector<std::string> arguments, std::vector<std::string> variables) {
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) fail(ErrorKind::device, "no pipe to a new process: {}", std::strerror(errno));
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
    posix_spawn_file_actions_adddup2(&actions, ends[1], STDERR_FILENO);
    const double start = now();
    pid_t process = 0;
    const int error = posix_spawn(&process, arguments.front().c_str(), &actions, nullptr, pointers(arguments).data(),
                                  pointers(variables).data());
    posix_spawn_file_actions_destroy(&actions);
    close(ends[1]);
    const std::unique_ptr<FILE, int (*)(FILE*)> output(fdopen(ends[0], "r"), fclose);
    if (error != 0)
        fail(ErrorKind::device, "cannot run {}: {}", arguments.front(), std::generic_category().message(error));

    Outcome outcome{0, 0};
    std::string said;
    for (std::array<char, 4096> line{}; std::fgets(line.data(), line.size(), output.get());) {
        const std::string_view text = line.data();
        if (outcome.seconds == 0 && text.starts_with(kFirstFrameWord))
            outcome = {now() - start, std::atoi(line.data() + std::strlen(kFirstFrameWord))};
        said += text;
    }
    int status = 0;
    waitpid(process, &status, 0);
    if (status != 0 || outcome.seconds == 0)
        fail(ErrorKind::device, "a new process came to no first frame: {}",
             said.substr(said.size() > 400 ? said.size() - 400 : 0));
    return outcome;
}

/// What is there already stays.
void add_files(const fs::path& from, const fs::path& to) {
    if (!fs::exists(from)) return;
    std::error_code unwritable;  // then nothing is kept
    fs::create_directories(to, unwritable);
    fs::copy(from, to, fs::copy_options::recursive | fs::copy_options::skip_existing, unwritable);
}

}  // namespace

Start measure_start(const fs::path& tool, const FirstFrame& first) {
    const io::TemporaryFolder folder;
    const std::vector<std::string> variables = environment(folder.path());
    const fs::path cache = clarus_cache(folder.path());
    // Kernels are those of the run that this is a part of.
    add_files(fs::path(cache_directory()) / "tuning", cache / "tuning");
    const auto start = [&](Size render_size) {
        return run({tool.string(), "bench", "first-frame", first.device, first.model, fmt::to_string(first.scale),
                    fmt::to_string(render_size.width), fmt::to_string(render_size.height), name_of(first.precision),
                    first.tuning == Tuning::fixed ? "fixed" : "stored"},
                   variables);
    };
    const Outcome cold = start(first.render_size), warm = start(first.render_size);
    add_files(cache / ocl::programs_directory().filename(), ocl::programs_directory());
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
