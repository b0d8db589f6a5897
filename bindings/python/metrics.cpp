#include <fmt/format.h>

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

using Array = nb::ndarray<const float, nb::ndim<3>, nb::c_contig, nb::device::cpu>;

io::Pixels pixels_of(const char* argument, nb::handle object) {
    Array array;
    if (!nb::try_cast(object, array, false) || array.shape(2) != 3)
        throw Error(
            ErrorKind::invalid_argument,
            fmt::format("{}: must be a contiguous float32 array of rows x columns x 3 in host memory", argument));
    const Size size{static_cast<int>(array.shape(1)), static_cast<int>(array.shape(0))};
    return {size, 3, {array.data(), array.data() + array.size()}};
}

/// What `measure` makes of both. It must touch nothing of Python's.
template <typename Measure>
auto measured(nb::handle image, nb::handle reference, Measure&& measure) {
    const io::Pixels one = pixels_of("image", image), other = pixels_of("reference", reference);
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
        "Of display values from 0 to 1, rows x columns x 3, float32: in dB, at most 100. Raises InvalidArgumentError.");
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
