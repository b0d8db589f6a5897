#include <nanobind/stl/string.h>

#include <array>
#include <string>
#include <utility>

#include "clarus/error.h"
#include "module.h"

namespace nb = nanobind;

namespace clarus::python {
namespace {

struct Class {
    const char* name;
    PyObject** also;  // the built-in exception that it is, too; null: none but what Error is
    const char* help;
};

// In the order of ErrorKind.
const std::array<Class, 6> classes{{
    {"InvalidArgumentError", &PyExc_ValueError, "A value that the caller gave; the message names it."},
    {"FileError", nullptr, "A file that is missing, unreadable or malformed; the message names it."},
    {"NoDeviceError", nullptr, "No OpenCL platform, or no device that fits the selector."},
    {"BuildError", nullptr, "A kernel did not compile; the message carries the compiler's log."},
    {"OutOfMemoryError", &PyExc_MemoryError, "Device or host memory."},
    {"DeviceError", nullptr, "Any other failure of OpenCL."},
}};

// Alive as long as the process, as the module is.
std::array<PyObject*, classes.size()> exceptions{};

PyObject* add_class(nb::module_& module, const char* name, nb::handle bases, const char* help) {
    const std::string full = nb::cast<std::string>(module.attr("__name__")) + "." + name;
    PyObject* made = PyErr_NewExceptionWithDoc(full.c_str(), help, bases.ptr(), nullptr);
    if (!made) nb::raise_python_error();
    module.attr(name) = nb::handle(made);
    return made;
}

void translate(const std::exception_ptr& thrown, void*) {
    try {
        std::rethrow_exception(thrown);
    } catch (const Error& error) {
        PyErr_SetString(exceptions[static_cast<size_t>(error.kind())], error.what());
    }
}

}  // namespace

void add_errors(nb::module_& module) {
    const nb::handle base = add_class(module, "Error", nb::handle(PyExc_RuntimeError),
                                      "What Clarus raises on purpose: it says what is wrong and what to do about it.");
    for (size_t kind = 0; kind < classes.size(); ++kind) {
        const Class& told = classes[kind];
        const nb::object bases =
            told.also ? nb::object(nb::make_tuple(base, nb::handle(*told.also))) : nb::borrow(base);
        exceptions[kind] = add_class(module, told.name, bases, told.help);
    }
    nb::register_exception_translator(translate);
}

}  // namespace clarus::python
