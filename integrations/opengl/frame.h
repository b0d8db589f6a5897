#ifndef CLARUS_OPENGL_FRAME_H
#define CLARUS_OPENGL_FRAME_H

/* What happens to a frame while a program draws it. Called where the program calls OpenGL. */

/* Around each draw call: the projection is jittered in between, and the program never sees it. */
void frame_before_draw(void);
void frame_after_draw(void);

/* Before a display list, which may hold draws or none. */
void frame_before_list(void);

/* Lists are not drawn while they are compiled. */
void frame_compiles_list(int is_compiling);

void frame_before_depth_clear(void);

/* Before the buffers are swapped. */
void frame_end(void);

#endif
