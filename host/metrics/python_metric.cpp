#include "metrics/python_metric.h"

#include <array>
#include <charconv>

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
    std::string answer;
    try {
        python_.emplace(script, std::array<std::string, 1>{package.prepare});
        answer = python_->receive_line();
    } catch (const Error& error) {
        answer = error.what();
    }
    if (answer == "ready") return;
    fail(ErrorKind::invalid_argument, "{} needs {} ({})", package.metric, package.how_to_get,
         answer.empty() ? "python3 ended" : answer);
}

double PythonMetric::measure(const io::Pixels& image, const io::Pixels& reference) {
    require_comparable(image, reference);
    const std::array<int32_t, 2> size{image.size.width, image.size.height};
    python_->send(size.data(), sizeof size);
    for (const io::Pixels* pixels : {&image, &reference})
        python_->send(pixels->values.data(), pixels->values.size() * sizeof(float));
    const std::string line = python_->receive_line();  // empty where it has ended
    double value = 0;
    if (std::from_chars(line.data(), line.data() + line.size(), value).ec != std::errc{})
        fail(ErrorKind::file, "python3 ended without a figure for {}; what it says is above", package_.metric);
    return value;
}

}  // namespace clarus::metrics
