#pragma once

#include <filesystem>
#include <memory>

#include "io/sequence.h"

namespace clarus::io {

/// Where the files of a new sequence go in one of the layouts of docs/formats.md, and how the layout wants their
/// values.
class OutputLayout {
  public:
    virtual ~OutputLayout() = default;

    /// Sets the conventions that the layout prescribes; those that it can write down stay as they are. The sequence has
    /// its sizes and scale. Errors: invalid_argument for what the layout cannot say.
    virtual void prescribe(Sequence& sequence) const = 0;
    /// Where the images of the frame with this index go, all for which the layout has a place.
    virtual FrameFiles place(const Sequence& sequence, size_t index) const = 0;
    /// The last file that `describe` writes. Where it exists, the sequence is whole.
    virtual std::filesystem::path description() const = 0;
    /// Describes a sequence whose images are all there. Errors: file.
    virtual void describe(const Sequence& sequence) const = 0;
};

/// `path` is what read_sequence takes, for the same layout. Errors: invalid_argument for a path that the layout does
/// not allow.
std::unique_ptr<OutputLayout> output_layout(const std::filesystem::path& path, Layout layout);

}  // namespace clarus::io
