#include "operator_harness.h"

#include <doctest/doctest.h>
#include <fmt/format.h>
#include <half.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <sstream>

#include "runtime/launch.h"
#include "runtime/short_launches.h"
#include "test_device.h"

namespace clarus::test {
namespace {

using runtime::Storage;
using runtime::TensorLayout;

constexpr size_t kSlack = 64;  // elements past a memory's end that vector loads may read
constexpr std::uint32_t kGarbage32 = 0x7fc0beef;
constexpr std::uint16_t kGarbage16 = 0x7eef;
constexpr unsigned char kGarbage8 = 0xbe;

/// A layout's memory as bytes.
std::vector<unsigned char> garbage(const TensorLayout& layout) {
    const size_t elements = static_cast<size_t>(layout.rows()) * layout.row() + kSlack;
    const size_t size = bytes_of(layout.storage);
    std::vector<unsigned char> memory(elements * size);
    for (size_t i = 0; i < elements; ++i) {
        if (size == 1)
            memory[i] = kGarbage8;
        else if (size == 2)
            std::memcpy(&memory[i * 2], &kGarbage16, 2);
        else
            std::memcpy(&memory[i * 4], &kGarbage32, 4);
    }
    return memory;
}

/// Calls visit(channel, x, y, the element's place in memory) for the whole image, row by row: the definition in
/// common.clh.
template <typename Visit>
void visit_elements(const TensorLayout& layout, Visit&& visit) {
    const int block = layout.block;
    for (int y = 0; y < layout.height; ++y) {
        const int row = layout.ring > 0 ? y / block % layout.ring : y / block;
        for (int c = 0; c < layout.channels; ++c) {
            for (int x = 0; x < layout.width; ++x) {
                const size_t cell = static_cast<size_t>(row) * layout.row() + x / block * layout.stride;
                const size_t element = cell + layout.offset + c * block * block + y % block * block + x % block;
                visit(c, x, y, element * bytes_of(layout.storage));
            }
        }
    }
}

void put(std::vector<unsigned char>& memory, size_t place, Storage storage, float value) {
    const half as_half = value;
    if (storage == Storage::u8)
        memory[place] = static_cast<unsigned char>(value);
    else if (storage == Storage::f16)
        std::memcpy(&memory[place], &as_half, 2);
    else
        std::memcpy(&memory[place], &value, 4);
}

float get(const std::vector<unsigned char>& memory, size_t place, Storage storage) {
    half as_half;
    float value;
    if (storage == Storage::u8) return memory[place];
    std::memcpy(&as_half, &memory[place], 2);
    if (storage == Storage::f16) return as_half;
    std::memcpy(&value, &memory[place], 4);
    return value;
}

cl::Buffer device_copy(ocl::Context& context, const void* data, size_t bytes) {
    cl::Buffer buffer(context.context(), CL_MEM_READ_WRITE, bytes);
    context.queue().enqueueWriteBuffer(buffer, CL_TRUE, 0, bytes, data);
    return buffer;
}

/// A check whose kernels may be compiled together with others'.
struct Check {
    runtime::KernelCall call;
    std::function<void()> make;
    std::string context;  // what CAPTURE said when it was asked for
};
std::vector<Check>* collected = nullptr;  // by the check_together() that runs

std::string captured() {
    std::ostringstream text;
    const auto* contexts = doctest::IReporter::get_active_contexts();
    for (int i = 0; i < doctest::IReporter::get_num_active_contexts(); ++i) {
        if (i > 0) text << ", ";
        contexts[i]->stringify(&text);
    }
    return text.str();
}

/// A problem that needs nothing of those who posed it.
struct OwnProblem {
    explicit OwnProblem(const runtime::Problem& posed) : problem(posed) {
        if (!posed.parameters) return;
        parameters = *posed.parameters;
        problem.parameters = &parameters;
    }
    OwnProblem(const OwnProblem&) = delete;
    OwnProblem& operator=(const OwnProblem&) = delete;

    runtime::Problem problem;
    graph::Parameters parameters;
};

/// Packs one set of a convolution's parameters as its kernel wants them.
cl::Buffer packed_weights(ocl::Context& context, const runtime::Lowered& lowered, const graph::Parameters& parameters,
                          int set) {
    if (lowered.packing->on_host) {
        const std::vector<std::int32_t> packed = lowered.packing->on_host(parameters, set);
        return device_copy(context, packed.data(), packed.size() * sizeof packed.front());
    }
    const cl::Buffer weights =
        device_copy(context, parameters.weights.data(), parameters.weights.size() * sizeof(float));
    const cl::Buffer biases = device_copy(context, parameters.biases.data(), parameters.biases.size() * sizeof(float));
    const cl::Buffer packed(context.context(), CL_MEM_READ_WRITE, lowered.packing->floats * sizeof(float));
    const runtime::PackLaunch::Source source{weights, set * parameters.weights_per_set(), biases,
                                             static_cast<size_t>(set) * parameters.out_channels};
    runtime::PackLaunch({context, {&lowered.packing->call}}, *lowered.packing)
        .enqueue(context.queue(), source, packed, 0);
    context.queue().finish();
    return packed;
}

/// Calls visit(implementation, choices) for whatever can run a problem on the test's device.
template <typename Visit>
void for_each_candidate(const runtime::Problem& problem, Visit&& visit) {
    const DeviceProfile profile = test_device().profile();
    for (const runtime::Implementation& implementation : runtime::implementations(problem.node)) {
        if (implementation.preference(problem, profile) == 0) continue;
        for (const runtime::Choices& choices : implementation.choices(problem, profile)) {
            std::string chosen = implementation.name;
            for (const auto& [name, value] : choices) chosen += fmt::format(" {}={}", name, value);
            CAPTURE(chosen);
            visit(implementation, choices);
        }
    }
}

/// What a ring holds when rows up to `end` have been made.
TensorLayout made_until(TensorLayout layout, int end) {
    layout.height = end;
    return layout;
}

Planes top_rows(const Planes& image, int end) {
    return planes({image.shape.channels, end, image.shape.width},
                  [&](int c, int x, int y) { return image.at(c, x, y); });
}

/// Calls visit(first, end) for the bands of rows that run_in_bands() makes.
constexpr int kBandRows = 8;
template <typename Visit>
void for_each_band(int height, Visit&& visit) {
    for (int first = 0; first < height; first += kBandRows) visit(first, std::min(first + kBandRows, height));
}

/// The problem with rings that hold no more than one band reads and makes.
runtime::Problem in_rings(runtime::Problem problem, const RowsRead& read) {
    problem.output.ring = kBandRows;
    problem.output.in_ring = true;
    for_each_band(problem.output.height, [&](int first, int end) {
        for (size_t i = 0; i < problem.inputs.size(); ++i) {
            const Rows rows = read(static_cast<int>(i), first, end);
            problem.inputs[i].in_ring = true;
            problem.inputs[i].ring = std::max(problem.inputs[i].ring, rows.end - rows.first);
        }
    });
    return problem;
}

/// How many rows of each input there must be for each band.
using RowsMade = std::vector<std::vector<int>>;

/// The result of a problem in_rings(), band by band.
Planes run_in_bands(const runtime::Problem& problem, const runtime::Lowered& lowered, const std::vector<Planes>& inputs,
                    const runtime::FrameConstants& frame, const RowsMade& rows_made) {
    const int height = problem.output.height;
    const Device device = test_device();
    ocl::Context& context = device.context();
    runtime::Launch launch({context, {&lowered.call}}, lowered.call);
    runtime::Bindings bindings;
    bindings.inputs.resize(inputs.size());
    bindings.frame = frame;
    if (lowered.packing) bindings.packed_weights = packed_weights(context, lowered, *problem.parameters, 0);
    Planes result{{problem.output.channels, height, problem.output.width}, {}};
    result.values.resize(result.shape.elements());
    for_each_band(height, [&](int first, int end) {
        for (size_t i = 0; i < inputs.size(); ++i) {
            const int made = rows_made[first / kBandRows][i];
            const Planes rows = top_rows(inputs[i], made);
            bindings.inputs[i] =
                upload(context, made_until(problem.inputs[i], made * problem.inputs[i].samples), &rows);
        }
        bindings.output = upload(context, made_until(problem.output, end));
        launch.bind(bindings);
        launch.enqueue_rows(context.queue(), first, end);
        const Planes rows = download(context, made_until(problem.output, end), bindings.output);
        for (int c = 0; c < rows.shape.channels; ++c)
            for (int y = first; y < end; ++y)
                for (int x = 0; x < rows.shape.width; ++x) result.at(c, x, y) = rows.at(c, x, y);
    });
    return result;
}

}  // namespace

Planes planes(graph::Shape shape, const std::function<float(int, int, int)>& value) {
    Planes image{shape, std::vector<float>(shape.elements())};
    for (int c = 0; c < shape.channels; ++c)
        for (int y = 0; y < shape.height; ++y)
            for (int x = 0; x < shape.width; ++x) image.at(c, x, y) = value(c, x, y);
    return image;
}

Planes random_planes(graph::Shape shape, std::mt19937& random, float low, float high) {
    std::uniform_real_distribution<float> values(low, high);
    return planes(shape, [&](int, int, int) { return values(random); });
}

Planes rounded(Planes image, Storage storage) {
    if (storage == Storage::f16)
        for (float& value : image.values) value = half(value);
    return image;
}

TensorLayout pixel_layout(graph::Shape shape, Storage storage) {
    return part_layout(shape, storage, 1, shape.channels, 0);
}

TensorLayout part_layout(graph::Shape shape, Storage storage, int block, int stride, int offset) {
    return {0, storage, shape.width, shape.height, shape.channels, block, stride, offset};
}

cl::Buffer upload(ocl::Context& context, const TensorLayout& whole, const Planes* image) {
    TensorLayout layout = whole;  // of what is stored
    layout.width /= layout.samples;
    layout.height /= layout.samples;
    layout.samples = 1;
    std::vector<unsigned char> memory = garbage(layout);
    if (image) {
        REQUIRE(image->shape == graph::Shape{layout.channels, layout.height, layout.width});
        visit_elements(
            layout, [&](int c, int x, int y, size_t place) { put(memory, place, layout.storage, image->at(c, x, y)); });
    }
    return device_copy(context, memory.data(), memory.size());
}

Planes download(ocl::Context& context, const TensorLayout& layout, const cl::Buffer& buffer) {
    std::vector<unsigned char> memory = garbage(layout);
    const std::vector<unsigned char> untouched = memory;
    context.queue().enqueueReadBuffer(buffer, CL_TRUE, 0, memory.size(), memory.data());

    Planes image{{layout.channels, layout.height, layout.width}, {}};
    image.values.resize(image.shape.elements());
    visit_elements(layout,
                   [&](int c, int x, int y, size_t place) { image.at(c, x, y) = get(memory, place, layout.storage); });
    visit_elements(layout, [&](int, int, int, size_t place) {
        std::memcpy(&memory[place], &untouched[place], bytes_of(layout.storage));
    });
    CHECK_MESSAGE(memory == untouched, "a kernel wrote beside its result");
    return image;
}

namespace {

Planes run(const runtime::Problem& problem, const runtime::Lowered& lowered, const std::vector<Planes>& inputs,
           const runtime::FrameConstants& frame, int parameter_set) {
    const Device device = test_device();
    ocl::Context& context = device.context();
    runtime::Bindings bindings;
    for (size_t i = 0; i < inputs.size(); ++i)
        bindings.inputs.push_back(upload(context, problem.inputs[i], &inputs[i]));
    // A result in place is written into its first input's memory.
    const bool in_place = graph::is_in_place(problem.node.op);
    bindings.output = in_place ? bindings.inputs[0] : upload(context, problem.output);
    bindings.frame = frame;
    if (lowered.packing) bindings.packed_weights = packed_weights(context, lowered, *problem.parameters, parameter_set);

    runtime::Launch launch({context, {&lowered.call}}, lowered.call);
    launch.bind(bindings);
    // The first work-groups' rows and the others apart, as long launches are split (runtime/short_launches.h).
    const runtime::KernelCall& call = lowered.call;
    const graph::Rows all = runtime::rows_of(call);
    const int group = std::min(static_cast<int>(call.local[call.row_axis]) * call.rows_an_item, all.end);
    launch.enqueue_rows(context.queue(), 0, group);
    if (group < all.end) launch.enqueue_rows(context.queue(), group, all.end);
    return download(context, problem.output, bindings.output);
}

}  // namespace

Planes run_operator(const runtime::Problem& problem, const runtime::Implementation& implementation,
                    const runtime::Choices& choices, const std::vector<Planes>& inputs,
                    const runtime::FrameConstants& frame, int parameter_set) {
    return run(problem, implementation.lower(problem, choices), inputs, frame, parameter_set);
}

void check_together(const std::function<void()>& body) {
    if (collected) return body();
    std::vector<Check> checks;
    collected = &checks;
    try {
        body();
    } catch (...) {
        collected = nullptr;
        throw;
    }
    collected = nullptr;
    std::vector<const runtime::KernelCall*> calls;
    for (const Check& check : checks) calls.push_back(&check.call);
    const runtime::Kernels together(test_device().context(), calls);  // the context keeps them
    for (const Check& check : checks) {
        INFO(check.context);
        check.make();
    }
}

void check_result(const runtime::Problem& problem, const runtime::Implementation& implementation,
                  const runtime::Choices& choices, const std::vector<Planes>& inputs,
                  const runtime::FrameConstants& frame, int parameter_set,
                  const std::function<void(const Planes& result)>& check) {
    const auto own = std::make_shared<const OwnProblem>(problem);
    const runtime::Lowered lowered = implementation.lower(own->problem, choices);
    check_together([&] {
        const auto make = [=] { check(run(own->problem, lowered, inputs, frame, parameter_set)); };
        collected->push_back({lowered.call, make, captured()});
    });
}

void check_close(const Planes& result, const Planes& expected, float tolerance) {
    REQUIRE(result.shape == expected.shape);
    size_t wrong = 0;
    std::string first;
    for (int c = 0; c < expected.shape.channels; ++c) {
        for (int y = 0; y < expected.shape.height; ++y) {
            for (int x = 0; x < expected.shape.width; ++x) {
                const float is = result.at(c, x, y), should = expected.at(c, x, y);
                const bool equal = is == should || (std::isnan(is) && std::isnan(should)) ||
                                   std::abs(is - should) <= tolerance * std::max(1.0f, std::abs(should));
                if (!equal && wrong++ == 0)
                    first = fmt::format("channel {} of pixel ({}, {}) is {}, not {}", c, x, y, is, should);
            }
        }
    }
    CHECK_MESSAGE(wrong == 0, wrong << " of " << expected.values.size() << " elements are wrong: " << first);
}

void check_operator(const runtime::Problem& problem, const std::vector<Planes>& inputs,
                    const runtime::FrameConstants& frame, const Planes& expected, float tolerance, int parameter_set) {
    check_together([&] {
        for_each_candidate(problem,
                           [&](const runtime::Implementation& implementation, const runtime::Choices& choices) {
                               check_result(problem, implementation, choices, inputs, frame, parameter_set,
                                            [=](const Planes& result) { check_close(result, expected, tolerance); });
                           });
    });
}

void check_bands(const runtime::Problem& problem, const std::vector<Planes>& inputs,
                 const runtime::FrameConstants& frame, const RowsRead& read, float tolerance) {
    const DeviceProfile profile = test_device().profile();
    const runtime::Implementation& obvious = runtime::implementations(problem.node).back();
    const auto own = std::make_shared<const OwnProblem>(in_rings(problem, read));
    RowsMade rows_made;
    for_each_band(problem.output.height, [&](int first, int end) {
        std::vector<int>& made = rows_made.emplace_back();
        for (size_t i = 0; i < inputs.size(); ++i) made.push_back(read(static_cast<int>(i), first, end).end);
    });
    check_together([&] {
        const auto expected = std::make_shared<Planes>();
        check_result(problem, obvious, obvious.choices(problem, profile).front(), inputs, frame, 0,
                     [=](const Planes& result) { *expected = result; });
        for_each_candidate(
            problem, [&](const runtime::Implementation& implementation, const runtime::Choices& choices) {
                const runtime::Lowered lowered = implementation.lower(own->problem, choices);
                const auto make = [=] {
                    check_close(run_in_bands(own->problem, lowered, inputs, frame, rows_made), *expected, tolerance);
                };
                collected->push_back({lowered.call, make, captured()});
            });
    });
}

}  // namespace clarus::test
