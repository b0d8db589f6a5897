#include "api/history.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <map>
#include <optional>
#include <utility>

#include "base/error.h"
#include "base/parse.h"
#include "io/safetensors.h"
#include "io/safetensors_writer.h"

namespace clarus {
namespace {

constexpr const char* kForm = "clarus history 1";

io::DataType type_of(runtime::Storage storage) {
    return storage == runtime::Storage::u8    ? io::DataType::i8
           : storage == runtime::Storage::f16 ? io::DataType::f16
                                              : io::DataType::f32;
}

runtime::Storage storage_of(io::DataType type) {
    if (type == io::DataType::i8) return runtime::Storage::u8;
    if (type == io::DataType::f16) return runtime::Storage::f16;
    if (type == io::DataType::f32) return runtime::Storage::f32;
    fail(ErrorKind::invalid_argument, "history: a tensor of a type that no device stores; f32, f16 and i8 are known");
}

float jitter_of(const io::Safetensors& file, const char* key) {
    return static_cast<float>(file.require_number(key, -1, 1));
}

}  // namespace

std::vector<std::byte> bytes_of(const History& history, const std::string& network) {
    std::map<std::string, std::string> metadata{{"form", kForm}, {"network", network}};
    std::map<std::string, io::NewTensor> tensors;
    if (!history.starts_anew) {
        metadata["render_size"] = fmt::format("{}x{}", history.render_size.width, history.render_size.height);
        metadata["jitter_x"] = fmt::format("{}", history.jitter.x);
        metadata["jitter_y"] = fmt::format("{}", history.jitter.y);
        metadata["computed_by"] = history.computed_by;
        for (const runtime::KeptValue& value : history.values) {
            metadata["layout of " + value.name] = value.layout;
            const auto elements = static_cast<int64_t>(value.bytes.size() / runtime::bytes_of(value.storage));
            tensors[value.name] =
                io::NewTensor::of(type_of(value.storage), {elements}, std::span<const std::byte>(value.bytes));
        }
    }
    const std::string bytes = io::safetensors_bytes(metadata, tensors);
    const auto span = std::as_bytes(std::span(bytes));
    return {span.begin(), span.end()};
}

History history_of(std::span<const std::byte> bytes, const std::string& network) {
    try {
        const io::Safetensors file =
            io::Safetensors::parse({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, "history");
        if (file.require_metadata("form") != kForm)
            fail(ErrorKind::invalid_argument, "history: its form is \"{}\", and \"{}\" is known here",
                 file.require_metadata("form"), kForm);
        if (file.require_metadata("network") != network)
            fail(ErrorKind::invalid_argument, "history: it is of {}, and this is {}", file.require_metadata("network"),
                 network);
        History history;
        if (!file.metadata().contains("render_size")) return history;
        history.starts_anew = false;
        const std::optional<Size> size = parse_size(file.require_metadata("render_size"));
        if (!size)
            fail(ErrorKind::invalid_argument, "history: its render_size is \"{}\"",
                 file.require_metadata("render_size"));
        history.render_size = *size;
        history.jitter = {jitter_of(file, "jitter_x"), jitter_of(file, "jitter_y")};
        history.computed_by = file.require_metadata("computed_by");
        for (const auto& [name, tensor] : file.tensors())
            history.values.push_back({name,
                                      file.require_metadata("layout of " + name),
                                      storage_of(tensor.type),
                                      {tensor.bytes.begin(), tensor.bytes.end()}});
        return history;
    } catch (const Error& error) {
        if (error.kind() == ErrorKind::file) fail(ErrorKind::invalid_argument, "{}", error.what());
        throw;
    }
}

}  // namespace clarus
