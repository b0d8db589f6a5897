#include <optional>
#include <utility>

#include "arrays.h"
#include "clarus/error.h"
#include "metrics/psnr.h"
#include "metrics/ssim.h"
#include "module.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace clarus::python {
namespace {

/// What `measure` makes of both. It must touch nothing of Python's.
template <typename Measure>
auto measured(nb::handle image, nb::handle reference, Measure&& measure) {
    const io::Pixels one = values_of("image", image, 3), other = values_of("reference", reference, 3);
    const nb::gil_scoped_release others_may_run;
    return measure(one, other);
}

}  // namespace

void add_metrics(nb::module_& module) {
    module.def(
        "psnr",
        [](nb::handle image, nb::handle reference) {
            return measured(image, reference, [](const io::Pixels& one, const io::Pixels& other) {
                return metrics::psnr(metrics::mean_squared_error(one, other));
            });
        },
        nb::sig("def psnr(image: object, reference: object) -> float"), "image"_a, "reference"_a,
        "Of display values from 0 to 1, or integers up to their largest, rows x columns x 3: in dB, at most 100. "
        "Raises "
        "InvalidArgumentError.");
    module.def(
        "ssim",
        [](nb::handle image, nb::handle reference) {
            return measured(image, reference, [](const io::Pixels& one, const io::Pixels& other) {
                const std::optional<double> similarity = metrics::ssim(one, other);
                if (!similarity) throw Error(ErrorKind::invalid_argument, "image: smaller than SSIM's window of 11x11");
                return *similarity;
            });
        },
        nb::sig("def ssim(image: object, reference: object) -> float"), "image"_a, "reference"_a,
        "Structural similarity (Wang et al. 2004) of the same, at most 1. Raises InvalidArgumentError.");
}

}  // namespace clarus::python
