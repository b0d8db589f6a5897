#include "api/model_identity.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <string_view>

#include "base/hash.h"
#include "io/safetensors.h"

namespace clarus {

std::string identity_of(const Model& model) {
    if (!model.tensors()) return fmt::format("{} x{}", model.name(), model.scale());
    std::string text;
    const auto add = [&](const std::string& name, std::string_view bytes) {
        text += fmt::format("{}:{};", name, hexadecimal(hash_of(bytes)));
    };
    for (const auto& [key, value] : model.metadata()) add(key, value);
    for (const auto& [name, tensor] : model.tensors()->tensors())
        add(fmt::format("{} {} {}", name, static_cast<int>(tensor.type), fmt::join(tensor.shape, "x")),
            {reinterpret_cast<const char*>(tensor.bytes.data()), tensor.bytes.size()});
    return fmt::format("a model x{} with the hash {}", model.scale(), hexadecimal(hash_of(text)));
}

}  // namespace clarus
