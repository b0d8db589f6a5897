#pragma once

#include "clarus/model.h"
#include "clarus/upscaler.h"
#include "io/sequence.h"

namespace clarus::cli {

/// Warns of what a sequence's description and headers say that is hardly meant, or that the model has no use for.
/// Errors: file, where the first image cannot be opened.
void warn_of_facts(const io::Sequence& sequence, const Upscaler& upscaler, const Model& model);

}  // namespace clarus::cli
