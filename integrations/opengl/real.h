#ifndef CLARUS_OPENGL_REAL_H
#define CLARUS_OPENGL_REAL_H

/* The functions behind those that the interposer takes the place of. */

/* libc's dlsym, of a library's handle. */
void* real_symbol(void* handle, const char* name);

/* OpenGL's, GLX's; NULL where the library has none of the name. */
void* real_function(const char* name);

#endif
