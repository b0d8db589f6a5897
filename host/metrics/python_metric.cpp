#include "metrics/python_metric.h"

#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <charconv>
#include <string_view>

#include "base/error.h"
#include "metrics/display.h"

namespace clarus::metrics {
namespace {

// After what prepares the metric: takes pairs of images, each pair after its width and height, and answers with a line
// a pair, after one of its own. What is printed on the way goes to stderr.
constexpr const char* script = R"(
import os, struct, sys
answers = os.fdopen(os.dup(1), "w")
os.dup2(2, 1)
try:
    import numpy
    exec(sys.argv[1])
except Exception as error:
    sys.exit(print(str(error).replace("\n", " "), file=answers, flush=True))
print("ready", file=answers, flush=True)
def receive(width, height):
    numbers = numpy.frombuffer(bytearray(sys.stdin.buffer.read(width * height * 12)), numpy.float32)
    return numbers.reshape(height, width, 3)
while header := sys.stdin.buffer.read(8):
    size = struct.unpack("ii", header)
    image, reference = receive(*size), receive(*size)
    print(float(measure(image, reference)), file=answers, flush=True)
)";

}  // namespace

const PythonPackage flip_package{"FLIP", R"(
import flip_evaluator
def measure(image, reference):
    return flip_evaluator.evaluate(reference, image, "LDR", applyMagma=False)[1]
)",
                                 "NVIDIA's evaluator; in a virtual environment: python3 -m venv flip && flip/bin/pip "
                                 "install flip-evaluator numpy && PATH=$PWD/flip/bin:$PATH clarus compare --flip …"};

const PythonPackage lpips_package{"LPIPS", R"(
import contextlib, io, warnings
warnings.filterwarnings("ignore")
import torch, torch.hub, lpips
def refuse(url, *arguments, **more):
    raise RuntimeError(f"{url} is not among the weights in {torch.hub.get_dir()}/checkpoints")
torch.hub.download_url_to_file = refuse
unheard = io.StringIO()  # it would speak of downloads
with contextlib.redirect_stdout(unheard), contextlib.redirect_stderr(unheard):
    network = lpips.LPIPS(net="alex", verbose=False)
def measure(image, reference):
    planes = [torch.from_numpy(each).permute(2, 0, 1)[None] for each in (image, reference)]
    with torch.no_grad():
        return network(*planes, normalize=True)
)",
                                  "PyPI's lpips with torchvision, and torchvision's weights of AlexNet, which are not "
                                  "fetched: put that file into torch.hub's folder"};

PythonMetric::PythonMetric(const PythonPackage& package) : package_(package) {
    std::array<int, 2> ends;
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0)
        fail(ErrorKind::file, "cannot talk to python3: no socket");
    socket_ = ends[0];
    posix_spawn_file_actions_t streams;
    posix_spawn_file_actions_init(&streams);
    for (const int stream : {STDIN_FILENO, STDOUT_FILENO}) posix_spawn_file_actions_adddup2(&streams, ends[1], stream);
    const std::array<const char*, 5> arguments{"python3", "-c", script, package.prepare, nullptr};
    const int error =
        posix_spawnp(&python_, "python3", &streams, nullptr, const_cast<char* const*>(arguments.data()), environ);
    posix_spawn_file_actions_destroy(&streams);
    close(ends[1]);
    const std::string answer = error == 0 ? receive_line() : "there is no python3";
    if (answer == "ready") return;
    close(socket_);
    if (error == 0) waitpid(python_, nullptr, 0);
    fail(ErrorKind::invalid_argument, "{} needs {} ({})", package.metric, package.how_to_get,
         answer.empty() ? "python3 ended" : answer);
}

PythonMetric::~PythonMetric() {
    close(socket_);
    waitpid(python_, nullptr, 0);
}

double PythonMetric::measure(const io::Pixels& image, const io::Pixels& reference) {
    require_comparable(image, reference);
    const std::array<int32_t, 2> size{image.size.width, image.size.height};
    send(size.data(), sizeof size);
    for (const io::Pixels* pixels : {&image, &reference})
        send(pixels->values.data(), pixels->values.size() * sizeof(float));
    const std::string line = receive_line();
    double value = 0;
    if (std::from_chars(line.data(), line.data() + line.size(), value).ec != std::errc{})
        fail(ErrorKind::file, "python3 ended without a figure for {}; what it says is above", package_.metric);
    return value;
}

void PythonMetric::send(const void* data, size_t bytes) {
    for (std::string_view rest(static_cast<const char*>(data), bytes); !rest.empty();) {
        const ssize_t sent = ::send(socket_, rest.data(), rest.size(), MSG_NOSIGNAL);
        if (sent < 0) return;  // It has ended: there will be no answer.
        rest.remove_prefix(static_cast<size_t>(sent));
    }
}

std::string PythonMetric::receive_line() {
    std::string line;
    for (char character; recv(socket_, &character, 1, 0) == 1 && character != '\n';) line += character;
    return line;
}

}  // namespace clarus::metrics
