#include "real.h"

#include <dlfcn.h>
#include <stddef.h>

typedef void* (*symbol_function)(void*, const char*);
typedef void* (*address_function)(const unsigned char*);

void* real_symbol(void* handle, const char* name) {
    static symbol_function real;
    if (!real) {
        /* dlsym is taken, so it is asked for by its versions: glibc 2.34's, and its first ones on x86-64 and AArch64.
         */
        static const char* const versions[] = {"GLIBC_2.34", "GLIBC_2.17", "GLIBC_2.2.5"};
        for (size_t i = 0; i < sizeof versions / sizeof *versions && !real; ++i)
            *(void**)&real = dlvsym(RTLD_NEXT, "dlsym", versions[i]);
    }
    /* A tail call: RTLD_NEXT means the caller's next, which dlsym knows by its return address. */
    return real ? real(handle, name) : NULL;
}

void* real_function(const char* name) {
    static void* library;
    static address_function address;
    if (!library) {
        library = dlopen("libGL.so.1", RTLD_LAZY | RTLD_LOCAL);
        if (!library) return NULL;
        *(void**)&address = real_symbol(library, "glXGetProcAddressARB");
    }
    void* found = real_symbol(library, name);
    return found || !address ? found : address((const unsigned char*)name);
}
