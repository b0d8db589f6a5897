#pragma once

namespace clarus {

/// The function of C linkage that a module exports. A module is a shared object in `lib…/clarus` that holds what needs
/// large libraries; it is loaded when it is first asked for, together with those, and stays. Errors: file, where this
/// build has no such module or a library of it is missing.
void* find_module_function(const char* module, const char* function);

template <typename Function>
Function* module_function(const char* module, const char* function) {
    return reinterpret_cast<Function*>(find_module_function(module, function));
}

}  // namespace clarus
