#include <nanobind/stl/string_view.h>

#include "clarus/log.h"
#include "module.h"

namespace nb = nanobind;

namespace clarus::python {

void add_messages(nb::module_&) {
    set_log_callback([](LogLevel level, std::string_view message) {
        if (!nb::is_alive()) return;  // the interpreter is about to go
        const nb::gil_scoped_acquire python;
        const char* const method = level == LogLevel::warning ? "warning" : level == LogLevel::info ? "info" : "debug";
        nb::module_::import_("logging").attr("getLogger")("clarus").attr(method)("%s", message);
    });
    // What is said after the interpreter has gone is not heard.
    nb::module_::import_("atexit").attr("register")(nb::cpp_function([] { set_log_callback({}); }));
}

}  // namespace clarus::python
