#pragma once

#include <string>

#include "clarus/model.h"

namespace clarus {

/// What tells a model from others: its name where it is a filter, else the hash of what its file says.
std::string identity_of(const Model& model);

}  // namespace clarus
