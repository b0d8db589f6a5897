#include "io/safetensors.h"

#include <Imath/half.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstring>
#include <limits>

#include "base/error.h"
#include "base/parse.h"
#include "io/file.h"
#include "io/json_reader.h"

namespace clarus::io {
namespace {

constexpr uint64_t longest_header = 100'000'000;
constexpr int64_t most = std::numeric_limits<int64_t>::max();

int64_t element_size(DataType type) {
    switch (type) {
        case DataType::f32:
        case DataType::i32:
            return 4;
        case DataType::f16:
            return 2;
        case DataType::i8:
            return 1;
    }
    fail(ErrorKind::invalid_argument, "no such data type: {}", static_cast<int>(type));
}

std::string shape_text(std::span<const int64_t> shape) {
    std::vector<std::string> extents;
    for (const int64_t extent : shape) extents.push_back(extent < 0 ? "any" : std::to_string(extent));
    return fmt::format("[{}]", fmt::join(extents, ", "));
}

struct Placed {
    int64_t begin, end;  // bytes in the body
    const std::string* name;
};

/// Without its bytes.
Tensor read_entry(const std::string& name, const JsonNode& entry, int64_t body_size, Placed& placed,
                  const std::filesystem::path& path) {
    Tensor tensor;
    tensor.name = name;
    tensor.file = path;
    tensor.type = entry["dtype"].choice<DataType>(
        {{"F32", DataType::f32}, {"F16", DataType::f16}, {"I8", DataType::i8}, {"I32", DataType::i32}});
    int64_t size = element_size(tensor.type);
    constexpr size_t most_extents = 16;
    const JsonNode shape = entry["shape"];
    if (shape.size() > most_extents) shape.refuse(fmt::format("a list of at most {}", most_extents));
    for (const JsonNode& extent : shape.items()) {
        tensor.shape.push_back(extent.integer(0, most));
        if (__builtin_mul_overflow(size, tensor.shape.back(), &size))
            fail(ErrorKind::file, "{}: tensor {} has the shape {}, which is too large", path.string(), name,
                 shape_text(tensor.shape));
    }
    const std::vector<JsonNode> offsets = entry["data_offsets"].items(2);
    placed.begin = offsets[0].integer(0, body_size);
    placed.end = offsets[1].integer(placed.begin, body_size);
    if (placed.end - placed.begin != size)
        fail(ErrorKind::file, "{}: tensor {} of the shape {} takes {} bytes, but its data_offsets hold {}",
             path.string(), name, shape_text(tensor.shape), size, placed.end - placed.begin);
    return tensor;
}

void check_that_tensors_tile(std::vector<Placed> tensors, int64_t body_size, const std::filesystem::path& path) {
    std::sort(tensors.begin(), tensors.end(),
              [](const Placed& a, const Placed& b) { return std::pair(a.begin, a.end) < std::pair(b.begin, b.end); });
    int64_t end = 0;
    for (size_t i = 0; i < tensors.size(); ++i) {
        if (tensors[i].begin < end)
            fail(ErrorKind::file, "{}: tensors {} and {} overlap", path.string(), *tensors[i - 1].name,
                 *tensors[i].name);
        if (tensors[i].begin > end)
            fail(ErrorKind::file, "{}: {} bytes before tensor {} belong to none", path.string(), tensors[i].begin - end,
                 *tensors[i].name);
        end = tensors[i].end;
    }
    if (end != body_size)
        fail(ErrorKind::file, "{}: {} bytes at the end belong to no tensor", path.string(), body_size - end);
}

/// What the header says, of a file of so many bytes that begins with these.
struct Header {
    std::map<std::string, std::string> metadata;
    std::map<std::string, Tensor> tensors;  // without their bytes
    std::vector<Placed> placed;             // of each tensor
    size_t body = 0;                        // where it begins, in bytes
};

/// Where the header ends. Errors: file.
size_t end_of_header(std::string_view begin, uintmax_t file_size, const std::filesystem::path& path) {
    uint64_t header_size = 0;
    if (begin.size() < sizeof header_size)
        fail(ErrorKind::file, "{} is no safetensors file: it has only {} bytes", path.string(), file_size);
    std::memcpy(&header_size, begin.data(), sizeof header_size);  // little-endian, as are all hosts we run on
    if (header_size > longest_header || header_size > file_size - sizeof header_size)
        fail(ErrorKind::file, "{} is no safetensors file or is cut short: its header claims {} bytes, the file has {}",
             path.string(), header_size, file_size);
    return sizeof header_size + header_size;
}

Header read_header(std::string_view begin, uintmax_t file_size, const std::filesystem::path& path) {
    Header header;
    header.body = end_of_header(begin, file_size, path);
    const auto body_size = static_cast<int64_t>(file_size - header.body);
    const nlohmann::json json = parse_json(begin.substr(sizeof(uint64_t), header.body - sizeof(uint64_t)), path);
    for (const auto& [name, entry] : JsonNode(json, path).members()) {
        if (name == "__metadata__") {
            for (const auto& [key, value] : entry.members()) header.metadata[key] = value.text();
            continue;
        }
        header.placed.emplace_back();
        const auto inserted =
            header.tensors.emplace(name, read_entry(name, entry, body_size, header.placed.back(), path)).first;
        header.placed.back().name = &inserted->first;
    }
    check_that_tensors_tile(header.placed, body_size, path);
    return header;
}

}  // namespace

int64_t Tensor::elements() const { return static_cast<int64_t>(bytes.size()) / element_size(type); }

int64_t Safetensors::elements() const {
    int64_t sum = 0;
    for (const auto& [name, tensor] : tensors_) sum += tensor.elements();
    return sum;
}

std::vector<float> Tensor::floats() const {
    std::vector<float> values(elements());
    if (type == DataType::f32) {
        if (!bytes.empty()) std::memcpy(values.data(), bytes.data(), bytes.size());
    } else if (type == DataType::f16) {
        for (size_t i = 0; i < values.size(); ++i) {
            uint16_t bits;
            std::memcpy(&bits, bytes.data() + 2 * i, 2);
            values[i] = Imath::half(Imath::half::FromBits, bits);
        }
    } else {
        fail(ErrorKind::file, "{}: tensor {} holds whole numbers where floating-point numbers are needed",
             file.string(), name);
    }
    return values;
}

Safetensors Safetensors::read(const std::filesystem::path& path) {
    // The header alone, before as much memory is taken as the file claims to be long.
    require_file(path);
    std::error_code error;
    const uintmax_t size = std::filesystem::file_size(path, error);
    if (error) fail(ErrorKind::file, "cannot read {}: {}", path.string(), error.message());
    const size_t body = end_of_header(read_beginning(path, sizeof(uint64_t)), size, path);
    read_header(read_beginning(path, body), size, path);
    return parse(read_file(path), path);
}

Safetensors Safetensors::parse(std::string bytes, const std::filesystem::path& path) {
    Safetensors file;
    file.path_ = path;
    file.data_ = std::make_shared<const std::string>(std::move(bytes));
    Header header = read_header(*file.data_, file.data_->size(), path);
    const std::span<const std::byte> body = std::as_bytes(std::span(*file.data_)).subspan(header.body);
    for (const Placed& placed : header.placed)
        header.tensors.at(*placed.name).bytes = body.subspan(placed.begin, placed.end - placed.begin);
    file.metadata_ = std::move(header.metadata);
    file.tensors_ = std::move(header.tensors);
    return file;
}

const Tensor& Safetensors::require(const std::string& name, std::span<const int64_t> shape) const {
    const auto found = tensors_.find(name);
    if (found == tensors_.end())
        fail(ErrorKind::file, "{} lacks the tensor {} of the shape {}", path_.string(), name, shape_text(shape));
    const Tensor& tensor = found->second;
    if (!std::ranges::equal(tensor.shape, shape, [](int64_t is, int64_t want) { return want < 0 || is == want; }))
        fail(ErrorKind::file, "{}: tensor {} has the shape {} where {} is expected", path_.string(), name,
             shape_text(tensor.shape), shape_text(shape));
    return tensor;
}

const std::string& Safetensors::require_metadata(const std::string& key) const {
    const auto found = metadata_.find(key);
    if (found == metadata_.end()) fail(ErrorKind::file, "{} lacks the metadata \"{}\"", path_.string(), key);
    return found->second;
}

int Safetensors::require_integer(const std::string& key, int low, int high) const {
    const std::string& text = require_metadata(key);
    const std::optional<int> value = parse_whole<int>(text);
    if (!value || *value < low || *value > high)
        fail(ErrorKind::file, "{}: the metadata \"{}\" must be a whole number from {} to {}, not \"{}\"",
             path_.string(), key, low, high, text);
    return *value;
}

double Safetensors::require_number(const std::string& key, double low, double high) const {
    const std::string& text = require_metadata(key);
    const std::optional<double> value = parse_number(text);
    if (!value || !(*value >= low && *value <= high))
        fail(ErrorKind::file, "{}: the metadata \"{}\" must be a number from {} to {}, not \"{}\"", path_.string(), key,
             low, high, text);
    return *value;
}

}  // namespace clarus::io
