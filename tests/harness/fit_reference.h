#pragma once

#include "operator_harness.h"

namespace clarus::test {

/// graph::Fit by its definition, in double.
Planes expected_fit(const Planes& image, Size size);

}  // namespace clarus::test
