#ifndef CLARUS_OPENGL_MATRIX_H
#define CLARUS_OPENGL_MATRIX_H

/* 4×4 matrices in OpenGL's order, column by column; in double, because a far plane thousands of times as far as the
   near one takes most of a float's digits when a projection is inverted. */
typedef struct matrix {
    double of[16];
} matrix;

matrix matrix_from(const float values[16]);
matrix matrix_product(const matrix* left, const matrix* right);
/* 0 where there is none. */
int matrix_inverse(const matrix* from, matrix* inverse);

/* Whether the points at infinity stay there and distances stay the same: a turn and a shift, no mirror and no scale. */
int is_rigid(const float values[16]);

/* What glFrustum makes: w is the distance along the view. Anything else, an orthographic projection among it, is not.
 */
int is_perspective(const float values[16]);

#endif
