#include "io/onnx_module.h"

#include <Imath/half.h>
#include <google/protobuf/arena.h>
#include <google/protobuf/stubs/logging.h>
#include <onnx/onnx_pb.h>

#include <cstdlib>
#include <cstring>
#include <new>

#include "base/error.h"

namespace clarus::io {
namespace {

constexpr int64_t kMostElements = int64_t{1} << 26;  // of all tensors together
constexpr int kMostNodes = 1 << 12, kMostTensors = 1 << 14, kMostExtents = 8, kMostNames = 1 << 10,
              kMostAttributes = 64;

/// What a message's objects may take, which can be a hundred times its bytes.
constexpr size_t kLeastMemory = size_t{64} << 20, kMemoryPerByte = 4;
thread_local size_t memory_left = 0;

void* take_block(size_t size) {
    if (size > memory_left) throw std::bad_alloc();
    memory_left -= size;
    if (void* block = std::malloc(size)) return block;
    throw std::bad_alloc();
}

void give_block(void* block, size_t size) {
    memory_left += size;
    std::free(block);
}

google::protobuf::ArenaOptions limited_memory(size_t bytes) {
    memory_left = kLeastMemory + kMemoryPerByte * bytes;
    google::protobuf::ArenaOptions options;
    options.block_alloc = take_block;
    options.block_dealloc = give_block;
    return options;
}

std::string type_name(int type) {
    const std::string& name = onnx::TensorProto_DataType_Name(type);
    return name.empty() ? "type " + std::to_string(type) : name;
}

class Reader {
  public:
    Reader(const onnx::ModelProto& model, const std::filesystem::path& path) : model_(model), path_(path) {}

    OnnxGraph read() {
        if (!model_.has_graph()) refuse("it has no graph");
        const onnx::GraphProto& graph = model_.graph();
        limit("nodes", graph.node_size(), kMostNodes);
        limit("initialisers", graph.initializer_size(), kMostTensors);
        limit("inputs", graph.input_size(), kMostTensors);
        limit("outputs", graph.output_size(), kMostNames);
        if (graph.sparse_initializer_size() > 0)
            refuse("its sparse initialisers are not taken: write it with dense ones");
        OnnxGraph result;
        result.path = path_;
        for (const onnx::OperatorSetIdProto& set : model_.opset_import())
            if (set.domain().empty() || set.domain() == "ai.onnx") result.opset = set.version();
        for (const onnx::TensorProto& each : graph.initializer())
            if (!result.tensors.emplace(each.name(), tensor(each, each.name())).second)
                refuse(fmt::format("two initialisers are named \"{}\"", each.name()));
        for (const onnx::ValueInfoProto& each : graph.input())
            if (!result.tensors.contains(each.name())) result.inputs.push_back(port(each));
        for (const onnx::ValueInfoProto& each : graph.output()) result.outputs.push_back(port(each));
        for (const onnx::NodeProto& each : graph.node()) result.nodes.push_back(node(each, result.nodes.size()));
        return result;
    }

  private:
    [[noreturn]] void refuse(const std::string& why) const { fail(ErrorKind::file, "{}: {}", path_.string(), why); }

    void limit(const char* what, int count, int most) const {
        if (count > most) refuse(fmt::format("it has {} {}; up to {} are taken", count, what, most));
    }

    OnnxTensor tensor(const onnx::TensorProto& source, const std::string& name) {
        if (source.data_location() == onnx::TensorProto::EXTERNAL || source.external_data_size() > 0)
            refuse(
                fmt::format("tensor \"{}\" is in another file (external data): write the network as one file, in "
                            "Python onnx.save(onnx.load(PATH), FILE)",
                            name));
        if (source.has_segment()) refuse(fmt::format("tensor \"{}\" is in segments, which are not taken", name));
        OnnxTensor result;
        result.type = type_name(source.data_type());
        result.shape.assign(source.dims().begin(), source.dims().end());
        const int64_t count = elements(result.shape, name);
        switch (source.data_type()) {
            case onnx::TensorProto::FLOAT:
                result.floats = values<float, float>(source, source.float_data(), count, name);
                break;
            case onnx::TensorProto::DOUBLE:
                result.floats = values<double, float>(source, source.double_data(), count, name);
                break;
            case onnx::TensorProto::FLOAT16:
                for (const uint16_t bits : values<uint16_t, uint16_t>(source, source.int32_data(), count, name))
                    result.floats.push_back(Imath::half(Imath::half::FromBits, bits));
                break;
            case onnx::TensorProto::INT64:
                result.integers = values<int64_t, int64_t>(source, source.int64_data(), count, name);
                break;
            case onnx::TensorProto::INT32:
                result.integers = values<int32_t, int64_t>(source, source.int32_data(), count, name);
                break;
            default:
                break;  // whoever reads it says which types it takes
        }
        return result;
    }

    /// How many a tensor of this shape has.
    int64_t elements(const std::vector<int64_t>& shape, const std::string& name) {
        if (shape.size() > kMostExtents)
            refuse(fmt::format("tensor \"{}\" has {} extents; up to {} are taken", name, shape.size(), kMostExtents));
        int64_t count = 1;
        for (const int64_t extent : shape) {
            if (extent < 0) refuse(fmt::format("tensor \"{}\" has the extent {}", name, extent));
            if (__builtin_mul_overflow(count, extent, &count) || count > kMostElements) count = kMostElements + 1;
        }
        elements_ += count;
        if (elements_ > kMostElements)
            refuse(fmt::format("tensors up to \"{}\" have more than {} elements in all", name, kMostElements));
        return count;
    }

    /// What the raw bytes hold, or the list that there is for elements of this type.
    template <typename Stored, typename Result, typename List>
    std::vector<Result> values(const onnx::TensorProto& source, const List& list, int64_t count,
                               const std::string& name) const {
        if (!source.has_raw_data()) {
            if (list.size() != count)
                refuse(fmt::format("tensor \"{}\" has {} elements where its shape has {}", name, list.size(), count));
            return std::vector<Result>(list.begin(), list.end());
        }
        const std::string& raw = source.raw_data();
        if (raw.size() != static_cast<size_t>(count) * sizeof(Stored))
            refuse(fmt::format("tensor \"{}\" has {} bytes where its shape takes {}", name, raw.size(),
                               static_cast<size_t>(count) * sizeof(Stored)));
        std::vector<Stored> stored(static_cast<size_t>(count));
        if (count > 0) std::memcpy(stored.data(), raw.data(), raw.size());  // little-endian, as all hosts we run on
        return std::vector<Result>(stored.begin(), stored.end());
    }

    OnnxPort port(const onnx::ValueInfoProto& source) const {
        OnnxPort result{source.name(), "no tensor", {}};
        if (!source.type().has_tensor_type()) return result;
        const onnx::TypeProto::Tensor& type = source.type().tensor_type();
        result.type = type_name(type.elem_type());
        if (!type.has_shape()) return result;
        limit("extents of an input or output", type.shape().dim_size(), kMostExtents);
        result.shape.emplace();
        for (const auto& extent : type.shape().dim())
            result.shape->push_back(extent.has_dim_value() && extent.dim_value() > 0 ? extent.dim_value() : -1);
        return result;
    }

    OnnxNode node(const onnx::NodeProto& source, size_t number) {
        OnnxNode result;
        const bool is_standard = source.domain().empty() || source.domain() == "ai.onnx";
        result.op = is_standard ? source.op_type() : source.domain() + "." + source.op_type();
        result.name = source.name().empty() ? "number " + std::to_string(number) : source.name();
        limit("inputs of a node", source.input_size(), kMostNames);
        limit("outputs of a node", source.output_size(), kMostNames);
        limit("attributes of a node", source.attribute_size(), kMostAttributes);
        result.inputs.assign(source.input().begin(), source.input().end());
        result.outputs.assign(source.output().begin(), source.output().end());
        for (const onnx::AttributeProto& each : source.attribute())
            result.attributes[each.name()] = attribute(each, result.name);
        return result;
    }

    OnnxAttribute attribute(const onnx::AttributeProto& source, const std::string& node) {
        using Kind = OnnxAttribute::Kind;
        OnnxAttribute result;
        switch (source.type()) {
            case onnx::AttributeProto::FLOAT:
                result.kind = Kind::number;
                result.number = source.f();
                break;
            case onnx::AttributeProto::INT:
                result.kind = Kind::integer;
                result.integer = source.i();
                break;
            case onnx::AttributeProto::STRING:
                result.kind = Kind::text;
                result.text = source.s();
                break;
            case onnx::AttributeProto::FLOATS:
                limit("numbers in an attribute", source.floats_size(), kMostNames);
                result.kind = Kind::numbers;
                result.numbers.assign(source.floats().begin(), source.floats().end());
                break;
            case onnx::AttributeProto::INTS:
                limit("numbers in an attribute", source.ints_size(), kMostNames);
                result.kind = Kind::integers;
                result.integers.assign(source.ints().begin(), source.ints().end());
                break;
            case onnx::AttributeProto::TENSOR:
                result.kind = Kind::tensor;
                result.tensor = tensor(source.t(), fmt::format("{} of node {}", source.name(), node));
                break;
            default:
                break;
        }
        return result;
    }

    const onnx::ModelProto& model_;
    const std::filesystem::path& path_;
    int64_t elements_ = 0;
};

class Onnx final : public OnnxModule {
  public:
    Onnx() { google::protobuf::SetLogHandler(nullptr); }  // errors are told by who calls

    OnnxGraph parse(const std::string& bytes, const std::filesystem::path& path) const override {
        google::protobuf::Arena arena(limited_memory(bytes.size()));
        onnx::ModelProto* model = nullptr;
        try {
            model = google::protobuf::Arena::CreateMessage<onnx::ModelProto>(&arena);
            if (!model->ParseFromArray(bytes.data(), static_cast<int>(bytes.size())))
                fail(ErrorKind::file, "{} is no ONNX file, or is cut short or damaged", path.string());
        } catch (const std::bad_alloc&) {
            fail(ErrorKind::file, "{} is no ONNX network: its {} bytes would take more than {} in memory",
                 path.string(), bytes.size(), kLeastMemory + kMemoryPerByte * bytes.size());
        }
        return Reader(*model, path).read();
    }
};

}  // namespace
}  // namespace clarus::io

extern "C" __attribute__((visibility("default"))) const clarus::io::OnnxModule& clarus_onnx() {
    static const clarus::io::Onnx instance;
    return instance;
}
