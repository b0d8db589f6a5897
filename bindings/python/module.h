#pragma once

#include <nanobind/nanobind.h>

#include <optional>
#include <string>

#include "clarus/model.h"

// The parts of the module, each of which module.cpp calls once.

namespace clarus::python {

/// What Model::find finds, of the scale 2 where none is given. Errors: its own; invalid_argument for a scale that is
/// not the model's own.
Model find_model(const std::string& name, std::optional<double> scale);

/// The exceptions, one a kind of Error, and that Error becomes them.
void add_errors(nanobind::module_& module);
/// What there is: devices, models, jitter.
void add_inquiry(nanobind::module_& module);
void add_upscaler(nanobind::module_& module);
/// What the library reports becomes messages of Python's logger "clarus".
void add_messages(nanobind::module_& module);
/// How near pictures are to a reference.
void add_metrics(nanobind::module_& module);
/// Whether frames hold what is declared of them.
void add_check(nanobind::module_& module);

}  // namespace clarus::python
