#include "pipelines/stack/onnx_sizes.h"

#include <algorithm>

namespace clarus::pipelines {
namespace {

using io::OnnxTensor;
using Inputs = std::vector<const OnnxTensor*>;

constexpr size_t kMostNumbers = 64;  // in a list of sizes

const OnnxTensor& input(const OnnxNodeReader& node, const Inputs& inputs, size_t i) {
    node.input(i);
    return *inputs[i];
}

/// Whole numbers of a scalar or a list, few enough to be sizes.
const std::vector<int64_t>& numbers(const OnnxNodeReader& node, const Inputs& inputs, size_t i) {
    const OnnxTensor& tensor = input(node, inputs, i);
    if (tensor.shape.size() > 1 || tensor.integers.empty() || tensor.integers.size() > kMostNumbers)
        node.refuse("of known values only lists of up to {} whole numbers are computed with", kMostNumbers);
    return tensor.integers;
}

int64_t combined(const OnnxNodeReader& node, int64_t a, int64_t b) {
    int64_t result = 0;
    bool is_wrong = false;
    if (node->op == "Add") is_wrong = __builtin_add_overflow(a, b, &result);
    if (node->op == "Sub") is_wrong = __builtin_sub_overflow(a, b, &result);
    if (node->op == "Mul") is_wrong = __builtin_mul_overflow(a, b, &result);
    if (node->op == "Div") {
        is_wrong = b == 0 || (b == -1 && a == INT64_MIN);
        if (!is_wrong) result = a / b;
    }
    if (is_wrong) node.refuse("{} and {} have no such result", a, b);
    return result;
}

OnnxTensor arithmetic(const OnnxNodeReader& node, const Inputs& inputs) {
    const std::vector<int64_t>&a = numbers(node, inputs, 0), &b = numbers(node, inputs, 1);
    if (a.size() != b.size() && a.size() != 1 && b.size() != 1)
        node.refuse("it combines {} sizes with {}", a.size(), b.size());
    OnnxTensor result = list_of({});
    for (size_t i = 0; i < std::max(a.size(), b.size()); ++i)
        result.integers.push_back(combined(node, a[a.size() == 1 ? 0 : i], b[b.size() == 1 ? 0 : i]));
    if (!inputs[0]->shape.empty() || !inputs[1]->shape.empty())
        result.shape = {static_cast<int64_t>(result.integers.size())};
    else
        result.shape.clear();
    return result;
}

OnnxTensor gathered(const OnnxNodeReader& node, const Inputs& inputs) {
    const std::vector<int64_t>& list = numbers(node, inputs, 0);
    OnnxTensor result = list_of({});
    for (int64_t place : numbers(node, inputs, 1)) {
        if (place < 0) place += std::ssize(list);
        if (place < 0 || place >= std::ssize(list)) node.refuse("it takes number {} of {}", place, list.size());
        result.integers.push_back(list[static_cast<size_t>(place)]);
    }
    result.shape = inputs[1]->shape;
    return result;
}

OnnxTensor sliced(const OnnxNodeReader& node, const Inputs& inputs) {
    const std::vector<int64_t>& list = numbers(node, inputs, 0);
    const bool has_inputs = inputs.size() > 1;
    const auto only = [&](const char* attribute, size_t i, int64_t otherwise) {
        std::vector<int64_t> values = has_inputs ? node.has_input(i) ? numbers(node, inputs, i) : std::vector{otherwise}
                                                 : node.integers(attribute).value_or(std::vector{otherwise});
        if (values.size() != 1) node.refuse("of a list of sizes it takes more than one part");
        return values.front();
    };
    if (only("axes", 3, 0) != 0 || only("steps", 4, 1) != 1) node.refuse("of a list of sizes it takes no plain part");
    const auto [begin, end] = sliced_range(std::ssize(list), only("starts", 1, 0), only("ends", 2, INT64_MAX));
    return list_of({list.begin() + begin, list.begin() + end});
}

OnnxTensor joined(const OnnxNodeReader& node, const Inputs& inputs) {
    node.expect("axis", 0);
    OnnxTensor result = list_of({});
    result.type = input(node, inputs, 0).type;
    for (size_t i = 0; i < inputs.size(); ++i) {
        const OnnxTensor& each = input(node, inputs, i);
        if (each.shape.size() != 1 || each.type != result.type || each.floats.size() > kMostNumbers ||
            each.integers.size() > kMostNumbers)
            node.refuse("of known values only short lists of one type are joined");
        result.floats.insert(result.floats.end(), each.floats.begin(), each.floats.end());
        result.integers.insert(result.integers.end(), each.integers.begin(), each.integers.end());
    }
    result.shape = {static_cast<int64_t>(result.floats.size() + result.integers.size())};
    return result;
}

OnnxTensor constant(const OnnxNodeReader& node) {
    if (const OnnxTensor* value = node.tensor("value")) return *value;
    if (node->attributes.contains("value_int")) {
        OnnxTensor scalar = list_of({node.integer("value_int", 0)});
        scalar.shape.clear();
        return scalar;
    }
    if (const auto values = node.integers("value_ints")) return list_of(*values);
    OnnxTensor result;
    result.type = "FLOAT";
    if (node->attributes.contains("value_float")) {
        result.floats = {node.number("value_float", 0)};
        return result;
    }
    const auto values = node.numbers("value_floats");
    if (!values) node.refuse("it has no value that is taken: value, value_int, value_ints, value_float, value_floats");
    result.floats = *values;
    result.shape = {std::ssize(*values)};
    return result;
}

}  // namespace

io::OnnxTensor list_of(std::vector<int64_t> numbers) {
    OnnxTensor result;
    result.type = "INT64";
    result.shape = {std::ssize(numbers)};
    result.integers = std::move(numbers);
    return result;
}

std::pair<int64_t, int64_t> sliced_range(int64_t extent, int64_t start, int64_t end) {
    const auto place = [extent](int64_t number) {
        return std::clamp<int64_t>(number < 0 ? number + extent : number, 0, extent);
    };
    return {place(start), std::max(place(start), place(end))};
}

std::optional<io::OnnxTensor> computed(const OnnxNodeReader& node, const std::vector<const io::OnnxTensor*>& inputs) {
    const std::string& op = node->op;
    if (op == "Constant") return constant(node);
    if (op == "Identity" || op == "Cast") {
        const OnnxTensor& value = input(node, inputs, 0);
        const int64_t to = node.integer("to", 0);
        const bool to_floats = to != 6 && to != 7;  // INT32, INT64
        if (op == "Cast" && to_floats != value.integers.empty())
            node.refuse("of known values it makes only whole numbers of whole numbers, and others of others");
        return value;
    }
    if (op == "Unsqueeze" || op == "Squeeze") {
        OnnxTensor result = list_of(numbers(node, inputs, 0));
        if (op == "Squeeze" && result.integers.size() == 1) result.shape.clear();
        return result;
    }
    if (op == "Gather") return gathered(node, inputs);
    if (op == "Slice") return sliced(node, inputs);
    if (op == "Concat") return joined(node, inputs);
    if (op == "Add" || op == "Sub" || op == "Mul" || op == "Div") return arithmetic(node, inputs);
    return std::nullopt;
}

}  // namespace clarus::pipelines
