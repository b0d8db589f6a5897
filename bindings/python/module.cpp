#include "module.h"

#include "clarus/version.h"

NB_MODULE(_clarus, module) {
    module.attr("version") = CLARUS_VERSION_STRING;
    clarus::python::add_errors(module);
    clarus::python::add_inquiry(module);
    clarus::python::add_upscaler(module);
    clarus::python::add_metrics(module);
    clarus::python::add_check(module);
    clarus::python::add_messages(module);
}
