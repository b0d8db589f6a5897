#include "io/enclosure.h"

#include <algorithm>
#include <utility>

#include "base/error.h"

namespace clarus::io {

Enclosure::Enclosure(std::filesystem::path folder)
    : folder_(std::move(folder)), canonical_(std::filesystem::canonical(folder_)) {}

std::filesystem::path Enclosure::target_of(const std::filesystem::path& path) {
    return std::filesystem::weakly_canonical(path);
}

bool Enclosure::holds(const std::filesystem::path& target) const {
    return std::ranges::mismatch(canonical_, target).in1 == canonical_.end();
}

void Enclosure::require(const std::filesystem::path& path) const {
    const std::filesystem::path target = target_of(path);
    if (!holds(target))
        fail(ErrorKind::file,
             "cannot read {}: a link leads it out of the sequence's folder {}, to {}; put a copy of the file there",
             path.string(), folder_.string(), target.string());
}

}  // namespace clarus::io
