#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <functional>
#include <stdexcept>

#include "base/rounding.h"
#include "runtime/implementations/lowering.h"

namespace clarus::runtime {
namespace {

using graph::Step;

std::string vector_type(std::string_view scalar, int width) {
    return width == 1 ? std::string(scalar) : fmt::format("{}{}", scalar, width);
}

/// `count` elements as runs of OpenCL's vector widths.
struct Run {
    int first, width;
};
std::vector<Run> runs(int count) {
    std::vector<Run> result;
    int first = 0;
    for (const int width : {16, 8, 4, 2, 1})
        for (; first + width <= count; first += width) result.push_back({first, width});
    return result;
}

std::vector<Run> singles(int count) {
    std::vector<Run> result;
    for (int i = 0; i < count; ++i) result.push_back({i, 1});
    return result;
}

/// An operand or the result in a kernel whose work-items handle cells of cell × cell pixels.
class Access {
  public:
    /// `qualifier`: "const " or nothing. `tensor`: the name of the layout in common.clh.
    Access(const TensorLayout& layout, std::string qualifier, std::string tensor, std::string pointer, int cell)
        : layout_(layout),
          qualifier_(std::move(qualifier)),
          tensor_(std::move(tensor)),
          pointer_(std::move(pointer)),
          cell_(cell) {}

    int channels() const { return layout_.channels; }
    std::string parameter() const {
        return fmt::format("global {}{}* {}{}_image", qualifier_, element_type(), qualifier_.empty() ? "restrict " : "",
                           pointer_);
    }

    /// Points to cell (x, y), or to the nearest pixel that a smaller image has.
    std::string point(const TensorLayout& whole) const {
        const std::string x = layout_.width < whole.width ? fmt::format("min(x, {}_WIDTH - 1)", tensor_) : "x";
        const std::string y = layout_.height < whole.height ? fmt::format("min(y, {}_HEIGHT - 1)", tensor_) : "y";
        const int pixels = layout_.tiled ? cell_ : 1;  // of the stored grid's unit, to a cell
        const std::string place =
            layout_.tiled || layout_.block == cell_
                ? fmt::format("AT_CELL({4}, {0} * {2} / {3}, {1} * {2} / {3})", x, y, pixels, layout_.samples, tensor_)
                : fmt::format("AT({3}, {0} * {2}, {1} * {2}, 0)", x, y, cell_, tensor_);
        std::string code = fmt::format("    global {}{}* {} = {}_image + {};\n", qualifier_, element_type(), pointer_,
                                       pointer_, place);
        if (layout_.samples == 1 || layout_.tiled) return code;
        return code +
               fmt::format("    const int {0}_is_sample = {1} % {3} == frame.{4}_x && {2} % {3} == frame.{4}_y;\n",
                           pointer_, x, y, layout_.samples, layout_.previous_samples ? "previous_sample" : "sample");
    }

    /// Channel c of some of the cell's pixels, which are counted along its rows; or of the cell so many to the right,
    /// if a tile is no larger than a cell.
    std::string load(int c, Run pixels, int right = 0) const {
        const int step = layout_.tiled || layout_.block == cell_ ? layout_.stride : cell_ * layout_.stride;
        const auto at = [&](const std::string& place) {
            return right > 0 ? fmt::format("{} + {}", place, right * step) : place;
        };
        if (layout_.tiled)
            return fmt::format("({})({})", vector_type("float", pixels.width), load_elements(at(fmt::to_string(c)), 1));
        if (layout_.samples > 1)
            return fmt::format("{}_is_sample ? {} : 0.0f", pointer_, load_elements(at(element(0, c)), 1));
        if (contiguous_pixels()) return load_elements(at(element(pixels.first, c)), pixels.width);
        std::string elements;
        for (int i = 0; i < pixels.width; ++i)
            elements += (i ? ", " : "") + load_elements(at(element(pixels.first + i, c)), 1);
        return fmt::format("({})({})", vector_type("float", pixels.width), elements);
    }

    /// The same of all pixels of four cells side by side. By twos, as compilers put vectors together best.
    std::string load_four(int c) const {
        const Run all{0, cell_ * cell_};
        const auto two = [&](int right) {
            return fmt::format("({})({}, {})", vector_type("float", 2 * all.width), load(c, all, right),
                               load(c, all, right + 1));
        };
        return fmt::format("({})({}, {})", vector_type("float", 4 * all.width), two(0), two(2));
    }

    /// Stores rows[] of rows_of_cells() in kernels/common.clh: pixels of four floats.
    std::string store_rows() const {
        std::string code;
        for (int half = 0; half < 4; ++half)
            code += fmt::format("    vstore16(rows[{0}], 0, {1} + {2} * {3}_ROW + {4});\n", half, pointer_, half / 2,
                                tensor_, half % 2 * 16);
        return code;
    }

    /// Stores values[c], of these pixels, to every channel c.
    std::string store(const std::vector<std::string>& values, Run pixels) const {
        std::string code;
        if (contiguous_pixels()) {
            for (int c = 0; c < channels(); ++c)
                code += store_elements(values[c], element(pixels.first, c), pixels.width);
            return code;
        }
        for (int i = 0; i < pixels.width; ++i) {
            for (const Run run : layout_.block == 1 ? runs(channels()) : singles(channels())) {
                std::string elements;
                for (int c = run.first; c < run.first + run.width; ++c)
                    elements +=
                        (c > run.first ? ", " : "") + values[c] + (pixels.width > 1 ? fmt::format(".s{:x}", i) : "");
                code += store_elements(fmt::format("({})({})", vector_type("float", run.width), elements),
                                       element(pixels.first + i, run.first), run.width);
            }
        }
        return code;
    }

  private:
    bool half() const { return layout_.storage == Storage::f16; }
    const char* element_type() const { return half() ? "half" : "float"; }
    bool contiguous_pixels() const { return layout_.block == cell_ && cell_ > 1; }

    std::string element(int pixel, int c) const {
        if (layout_.block == cell_) return fmt::to_string(c * cell_ * cell_ + pixel);
        // Either the cell is one pixel, or the layout has blocks of one pixel.
        return fmt::format("{} * {}_ROW + {}", pixel / cell_, tensor_,
                           pixel % cell_ * layout_.stride + c * layout_.block * layout_.block);
    }

    std::string load_elements(const std::string& first, int width) const {
        if (half() && width > 4) {
            // PoCL's vload_half8 wants more than the halves' alignment.
            const int part = width / 2;
            return fmt::format("({})({}, {})", vector_type("float", width), load_elements(first, part),
                               load_elements(fmt::format("{} + {}", first, part), part));
        }
        if (half()) {
            return width == 1 ? fmt::format("vload_half({}, {})", first, pointer_)
                              : fmt::format("vload_half{}(0, {} + {})", width, pointer_, first);
        }
        return width == 1 ? fmt::format("{}[{}]", pointer_, first)
                          : fmt::format("vload{}(0, {} + {})", width, pointer_, first);
    }

    std::string store_elements(const std::string& value, const std::string& first, int width) const {
        const std::string lanes = width == 1 ? "" : std::to_string(width);
        if (half()) {
            const std::string place = width == 1 ? fmt::format("{}, {}", first, pointer_)  // in elements, not vectors
                                                 : fmt::format("0, {} + {}", pointer_, first);
            return fmt::format("    vstore_half{}(IN_HALF_RANGE({}), {});\n", lanes, value, place);
        }
        return width == 1 ? fmt::format("    {}[{}] = {};\n", pointer_, first, value)
                          : fmt::format("    vstore{}({}, 0, {} + {});\n", lanes, value, pointer_, first);
    }

    TensorLayout layout_;
    std::string qualifier_, tensor_, pointer_;
    int cell_;
};

/// Channel c of a step that treats channels alike.
std::string expression(const Step& step, const std::vector<std::string>& operands, int c, int width) {
    const std::string type = vector_type("float", width);
    switch (step.function) {
        case Step::Function::sigmoid:
            return fmt::format("sigmoid_{}({})", type, operands[0]);
        case Step::Function::mix:
            return fmt::format("MAD({2}, {0} - {1}, {1})", operands[0], operands[1], operands[2]);
        case Step::Function::tanh:
            return fmt::format("tanh_{}({})", type, operands[0]);
        case Step::Function::prelu:
            return fmt::format("{0} > 0 ? {0} : {0} * {1:.9e}f", operands[0], step.coefficients[c]);
        case Step::Function::sum:
            return fmt::format("{} + {}", operands[0], operands[1]);
        case Step::Function::difference:
            return fmt::format("fabs({} - {})", operands[0], operands[1]);
        case Step::Function::minimum:
            return fmt::format("({0} < {1}) ? {0} : {1}", operands[0], operands[1]);
        case Step::Function::maximum:
            return fmt::format("({0} > {1}) ? {0} : {1}", operands[0], operands[1]);
        case Step::Function::product:
            return fmt::format("{} * {}", operands[0], operands[1]);
        case Step::Function::linear: {
            std::string sum = fmt::format("({})({:.9e}f)", type, step.addend);
            for (size_t i = 0; i < operands.size(); ++i)
                sum = fmt::format("MAD({}, ({})({:.9e}f), {})", operands[i], type, step.coefficients[i], sum);
            return sum;
        }
        case Step::Function::clamp:
            // A NaN becomes the lower limit: it must not get into a state.
            return fmt::format("({1:.9e}f < {0}) ? (({0} < {2:.9e}f) ? {0} : ({3})({2:.9e}f)) : ({3})({1:.9e}f)",
                               operands[0], step.low, step.high, type);
        case Step::Function::round:
            return fmt::format("floor({} + 0.5f)", operands[0]);
        case Step::Function::softmax:
        case Step::Function::channel_maximum:
        case Step::Function::channel_sum:
            break;
    }
    throw std::logic_error("unknown pointwise function");
}

bool is_across_channels(const Step& step) {
    return step.function == Step::Function::softmax || step.function == Step::Function::channel_maximum ||
           step.function == Step::Function::channel_sum;
}

/// The values' sum or maximum.
std::string reduced(const std::vector<std::string>& values, bool maximum) {
    std::string result = values.front();
    for (size_t i = 1; i < values.size(); ++i)
        result = fmt::format(fmt::runtime(maximum ? "fmax({}, {})" : "{} + {}"), result, values[i]);
    return result;
}

/// A step across channels: the definitions of its results, in variables whose names begin with `name` and end with the
/// channel's number, from those of its operand.
std::string across_channels(const Step& step, const std::vector<std::string>& operand, const std::string& name,
                            int width) {
    const std::string type = vector_type("float", width);
    const int channels = static_cast<int>(operand.size()) / step.groups;
    std::string code;
    for (int group = 0; group < step.groups; ++group) {
        const auto begin = operand.begin() + group * channels;
        const std::vector<std::string> members(begin, begin + channels);
        if (step.function != Step::Function::softmax) {
            code += fmt::format("    const {} {}{} = {};\n", type, name, group,
                                reduced(members, step.function == Step::Function::channel_maximum));
            continue;
        }
        const std::string most = fmt::format("{}most{}", name, group), total = fmt::format("{}total{}", name, group);
        code += fmt::format("    const {} {} = {};\n", type, most, reduced(members, true));
        std::vector<std::string> powers;
        for (const std::string& member : members) {
            powers.push_back(fmt::format("{}power{}", name, group * channels + powers.size()));
            code += fmt::format("    const {0} {1} = exp2_{0}(fmax(({2} - {3}) * 1.44269504f, -126.0f));\n", type,
                                powers.back(), member, most);
        }
        code += fmt::format("    const {} {} = 1.0f / ({});\n", type, total, reduced(powers, false));
        for (int c = 0; c < channels; ++c)
            code += fmt::format("    const {} {}{} = {} * {};\n", type, name, group * channels + c, powers[c], total);
    }
    return code;
}

/// The caller's image as a second result of a kernel whose work-items handle cells of cell × cell pixels; kernels/
/// present.cl with the colours at hand.
class CallersImage {
  public:
    CallersImage(const Presented& presented, int cell) : presented_(presented), cell_(cell) {}

    static std::string parameters() { return "global uchar* target, uint2 place, "; }

    /// Points to each of the cell's rows.
    std::string point() const {
        std::string code;
        for (int row = 0; row < cell_; ++row)
            code += fmt::format(
                "    global {0}* shown{1} = (global {0}*)(target + place.x + (size_t)(y * {2} + {1}) * place.y) + "
                "x * {3};\n",
                type(), row, cell_, cell_ * presented_.format.channels);
        return code;
    }

    /// Stores the colours among values[c] of these pixels.
    std::string store(const std::vector<std::string>& values, Run pixels) const {
        const std::string vector = vector_type("float", pixels.width);
        std::string code;
        for (int c = 0; c < presented_.channels; ++c)  // a NaN becomes 0
            code += fmt::format("    const {0} shown_{1} = {2} > 0 ? min({2}, 1.0f) : ({0})(0.0f);\n", vector, c,
                                values[presented_.first_channel + c]);
        // Pixels that follow each other in a row of the cell.
        for (int first = 0; first < pixels.width;) {
            const int column = (pixels.first + first) % cell_, row = (pixels.first + first) / cell_;
            const int count = std::min(cell_ - column, pixels.width - first), channels = presented_.format.channels;
            std::vector<std::string> elements;
            for (int i = first; i < first + count; ++i)
                for (int c = 0; c < channels; ++c)
                    elements.push_back(c == presented_.channels ? "1.0f"
                                       : pixels.width > 1       ? fmt::format("shown_{}.s{:x}", c, i)
                                                                : fmt::format("shown_{}", c));
            for (const Run run : runs(count * channels)) {
                const auto begin = elements.begin() + run.first;
                code += store_elements(fmt::format("{}", fmt::join(begin, begin + run.width, ", ")), run.width,
                                       fmt::format("shown{} + {}", row, column * channels + run.first));
            }
            first += count;
        }
        return code;
    }

    /// Those of rows[] of rows_of_cells() in kernels/common.clh, which begin with the channels that are shown.
    std::string store_rows() const {
        std::string code;
        for (int half = 0; half < 4; ++half) {
            const std::string place = fmt::format("shown{} + {}", half / 2, half % 2 * 4 * presented_.format.channels);
            code += fmt::format("    rows[{0}] = rows[{0}] > 0 ? min(rows[{0}], 1.0f) : (float16)(0.0f);\n", half);
            if (presented_.format.channels == 4) {
                if (presented_.channels == 3) code += fmt::format("    rows[{}].s37bf = 1.0f;\n", half);
                code += store_elements(fmt::format("rows[{}]", half), 16, place);
            } else {
                code += store_elements(fmt::format("rows[{}].s01245689", half), 8, place);
                code += store_elements(fmt::format("rows[{}].sacde", half), 4, place + " + 8");
            }
        }
        return code;
    }

  private:
    /// As WRITE_uchar, WRITE_half and WRITE_float do.
    std::string store_elements(const std::string& elements, int width, const std::string& place) const {
        const std::string lanes = width == 1 ? "" : std::to_string(width);
        const std::string vector = fmt::format("({})({})", vector_type("float", width), elements);
        switch (presented_.format.type) {
            case ElementType::u8:
                return width == 1 ? fmt::format("    *({}) = (uchar)({} * 255.0f + 0.5f);\n", place, vector)
                                  : fmt::format("    vstore{0}(convert_uchar{0}({1} * 255.0f + 0.5f), 0, {2});\n",
                                                lanes, vector, place);
            case ElementType::f16:
                return fmt::format("    vstore_half{}({}, 0, {});\n", lanes, vector, place);
            case ElementType::f32:
                return width == 1 ? fmt::format("    *({}) = {};\n", place, vector)
                                  : fmt::format("    vstore{}({}, 0, {});\n", lanes, vector, place);
            default:
                throw std::logic_error("an element type that is not written");
        }
    }

    std::string_view type() const { return opencl_type(presented_.format.type); }

    Presented presented_;
    int cell_;
};

/// The program for vectors of so many pixels: operands and steps, without the end of the block. Variable vN_C is
/// channel C of operand N; those that are the results are appended to `results`.
std::string steps(const graph::Pointwise& program, const std::vector<Access>& inputs, int width,
                  const std::function<std::string(const Access& input, int c)>& load,
                  std::vector<std::string>& results) {
    const std::string type = vector_type("float", width);
    std::string code = "    {\n";
    std::vector<int> channels;
    const auto variable = [&](int operand, int c) {
        return fmt::format("v{}_{}", operand, channels[operand] == 1 ? 0 : c);
    };
    const auto define = [&](int operand, int c, const std::string& value) {
        code += fmt::format("    const {} v{}_{} = {};\n", type, operand, c, value);
    };
    for (const Access& input : inputs) {
        const int operand = static_cast<int>(channels.size());
        channels.push_back(input.channels());
        for (int c = 0; c < input.channels(); ++c) define(operand, c, load(input, c));
    }
    for (const Step& step : program.steps) {
        const int operand = static_cast<int>(channels.size());
        int count = 1;
        for (const int from : step.operands) count = std::max(count, channels[from]);
        if (is_across_channels(step)) {
            std::vector<std::string> operands;
            for (int c = 0; c < count; ++c) operands.push_back(variable(step.operands[0], c));
            code += across_channels(step, operands, fmt::format("v{}_", operand), width);
            channels.push_back(step.function == Step::Function::softmax ? count : step.groups);
            continue;
        }
        for (int c = 0; c < count; ++c) {
            std::vector<std::string> operands;
            for (const int from : step.operands) operands.push_back(variable(from, c));
            define(operand, c, expression(step, operands, c, width));
        }
        channels.push_back(count);
    }
    for (const int result : program.results)
        for (int c = 0; c < channels[result]; ++c) results.push_back(variable(result, c));
    return code;
}

/// The program for some of a cell's pixels.
std::string body(const graph::Pointwise& program, const std::vector<Access>& inputs, const Access& output,
                 const std::optional<CallersImage>& image, Run pixels) {
    std::vector<std::string> results;
    std::string code = steps(
        program, inputs, pixels.width, [&](const Access& input, int c) { return input.load(c, pixels); }, results);
    code += output.store(results, pixels);
    if (image) code += image->store(results, pixels);
    return code + "    }\n";
}

/// The program for four cells of 2×2 pixels side by side.
std::string body_of_four(const graph::Pointwise& program, const std::vector<Access>& inputs, const Access& output,
                         const std::optional<CallersImage>& image) {
    std::vector<std::string> results;
    std::string code = steps(
        program, inputs, 16, [](const Access& input, int c) { return input.load_four(c); }, results);
    code += fmt::format("    float16 rows[4] = {{{}}};\n    rows_of_cells(rows);\n", fmt::join(results, ", "));
    code += output.store_rows();
    if (image) code += image->store_rows();
    return code + "    }\n";
}

Lowered lower(const Problem& problem, const Choices& choices, int cell, bool by_fours = false) {
    const auto& program = std::get<graph::Pointwise>(problem.node.op);
    KernelCall call;
    call.file = call.entry = "pointwise";
    call.local = group_size(choices);
    const int strip = choices.contains("STRIP") ? choices.at("STRIP") : 1;
    call.global = {static_cast<size_t>(ceil_divide(problem.output.width / cell, strip)),
                   static_cast<size_t>(problem.output.height / cell)};

    std::vector<Access> inputs;
    std::string parameters, pointers;
    for (const TensorLayout& layout : problem.inputs) {
        const int index = static_cast<int>(inputs.size());
        const std::string tensor = fmt::format("IN{}", index);
        add_tensor(call, tensor, layout);
        inputs.emplace_back(layout, "const ", tensor, fmt::format("in{}", index), cell);
        parameters += inputs.back().parameter() + ", ";
        pointers += inputs.back().point(problem.output);
        call.arguments.push_back({ArgumentKind::input, index});
    }
    add_tensor(call, "OUT", problem.output);
    const Access output(problem.output, "", "OUT", "out", cell);
    call.arguments.push_back({ArgumentKind::output});
    std::optional<CallersImage> image;
    if (problem.presented) {
        image.emplace(*problem.presented, cell);
        call.arguments.insert(call.arguments.end(), {{ArgumentKind::target}, {ArgumentKind::target_offset}});
    }
    call.arguments.push_back({ArgumentKind::frame});

    call.source = fmt::format(
        "kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void pointwise(\n"
        "    Sizes given, {}{}, {}Frame frame) {{\n"
        "    TAKE(sizes);\n"
        "    const int y = ROW_ITEM(1), first = (int)get_global_id(0) * {};\n",
        parameters, output.parameter(), image ? CallersImage::parameters() : "", strip);
    // A loop, even of one turn, keeps compilers from making vectors of work-items.
    pointers += output.point(problem.output);
    if (image) pointers += image->point();
    if (strip == 1) {
        call.source += fmt::format(
            "    const int x = first;\n"
            "    if (x >= OUT_WIDTH / {0} || y >= OUT_HEIGHT / {0}) return;\n    {{\n",
            cell);
    } else {
        call.source += fmt::format(
            "    if (y >= OUT_HEIGHT / {0}) return;\n"
            "    const int end = min(first + {1}, OUT_WIDTH / {0});\n"
            "    int x = first;\n",
            cell, strip);
        if (by_fours)
            call.source += "    for (; x + 4 <= end; x += 4) {\n" + pointers +
                           body_of_four(program, inputs, output, image) + "    }\n";
        call.source += "    for (; x < end; ++x) {\n";
    }
    call.source += pointers;
    for (const Run pixels_of_cell : runs(cell * cell))
        call.source += body(program, inputs, output, image, pixels_of_cell);
    call.source += "    }\n}\n";
    return {std::move(call), std::nullopt};
}

/// The side of the blocks that some of the images are stored in; 1 where none is, 0 where they disagree.
int common_block(const Problem& problem) {
    int block = problem.output.block;
    bool agree = true;
    for (const TensorLayout& input : problem.inputs) {
        agree = agree && (block == 1 || input.block == 1 || input.block == block) &&
                (input.samples == 1 || input.tiled) && input.width == problem.output.width &&
                input.height == problem.output.height;
        block = std::max(block, input.block);
    }
    // All pixels of a block are in one tile.
    for (const TensorLayout& input : problem.inputs) agree = agree && (!input.tiled || input.samples % block == 0);
    const bool whole = problem.output.width % block == 0 && problem.output.height % block == 0;
    return agree && whole ? block : 0;
}

int prefer_cells(const Problem& problem, const DeviceProfile&) { return common_block(problem) > 1 ? 2 : 0; }

Lowered lower_cells(const Problem& problem, const Choices& choices) {
    return lower(problem, choices, common_block(problem));
}

/// Four cells of 2×2 pixels side by side fill a vector of sixteen, and their pixels one after another four more.
int prefer_four_cells(const Problem& problem, const DeviceProfile& profile) {
    const TensorLayout& output = problem.output;
    const auto small = [](const TensorLayout& input) { return !input.tiled || input.samples == 2; };
    const bool fits = common_block(problem) == 2 && output.block == 1 && output.channels == 4 && output.stride == 4 &&
                      output.storage == Storage::f32 && (!problem.presented || problem.presented->first_channel == 0) &&
                      std::all_of(problem.inputs.begin(), problem.inputs.end(), small);
    return fits && !wants_many_work_items(profile) ? 3 : 0;
}

std::vector<Choices> four_cells_choices(const Problem&, const DeviceProfile&) {
    return {{{"WG_X", 1}, {"WG_Y", 1}, {"STRIP", 64}}};
}

Lowered lower_four_cells(const Problem& problem, const Choices& choices) { return lower(problem, choices, 2, true); }

std::vector<Choices> pixel_choices(const Problem& problem, const DeviceProfile& profile) {
    // Fewer channels than that make no vectors: those of pixels are better.
    constexpr int kManyChannels = 24;
    std::vector<Choices> result = strip_choices(problem, profile);
    int channels = problem.output.channels;
    for (const TensorLayout& input : problem.inputs) channels += input.channels;
    if (channels < kManyChannels && result.front().at("STRIP") > 1)
        std::rotate(result.begin(), result.begin() + 1, result.end());
    return result;
}

Lowered lower_pixels(const Problem& problem, const Choices& choices) { return lower(problem, choices, 1); }

}  // namespace

std::span<const Implementation> pointwise_implementations() {
    // The same program for one pixel, and for all pixels of a block at once, where a channel's are a vector.
    static const Implementation implementations[] = {
        {"pointwise four cells", prefer_four_cells, four_cells_choices, lower_four_cells},
        {"pointwise cells", prefer_cells, group_choices, lower_cells},
        {"pointwise", obvious, pixel_choices, lower_pixels}};
    return implementations;
}

}  // namespace clarus::runtime
