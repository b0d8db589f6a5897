#include "matrix.h"

#include <math.h>

matrix matrix_from(const float values[16]) {
    matrix result;
    for (int i = 0; i < 16; ++i) result.of[i] = values[i];
    return result;
}

matrix matrix_product(const matrix* left, const matrix* right) {
    matrix result;
    for (int column = 0; column < 4; ++column)
        for (int row = 0; row < 4; ++row) {
            double sum = 0;
            for (int k = 0; k < 4; ++k) sum += left->of[4 * k + row] * right->of[4 * column + k];
            result.of[4 * column + row] = sum;
        }
    return result;
}

/* Gauss and Jordan, with the largest pivot of each column. */
int matrix_inverse(const matrix* from, matrix* inverse) {
    double rows[4][8];
    for (int row = 0; row < 4; ++row)
        for (int column = 0; column < 8; ++column)
            rows[row][column] = column < 4 ? from->of[4 * column + row] : column - 4 == row;
    for (int column = 0; column < 4; ++column) {
        int pivot = column;
        for (int row = column + 1; row < 4; ++row)
            if (fabs(rows[row][column]) > fabs(rows[pivot][column])) pivot = row;
        const double value = rows[pivot][column];
        if (!isfinite(value) || value == 0) return 0;
        for (int k = 0; k < 8; ++k) {
            const double moved = rows[pivot][k] / value;
            rows[pivot][k] = rows[column][k];
            rows[column][k] = moved;
        }
        for (int row = 0; row < 4; ++row) {
            if (row == column) continue;
            const double factor = rows[row][column];
            for (int k = 0; k < 8; ++k) rows[row][k] -= factor * rows[column][k];
        }
    }
    for (int row = 0; row < 4; ++row)
        for (int column = 0; column < 4; ++column) inverse->of[4 * column + row] = rows[row][4 + column];
    return 1;
}

static double dot(const float* one, const float* other) {
    return (double)one[0] * other[0] + (double)one[1] * other[1] + (double)one[2] * other[2];
}

int is_rigid(const float values[16]) {
    const float *x = values, *y = values + 4, *z = values + 8;
    const double tolerance = 1e-3; /* of what a game makes of floats, frame after frame */
    const float across[3] = {x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]};
    return fabs(dot(x, x) - 1) < tolerance && fabs(dot(y, y) - 1) < tolerance && fabs(dot(z, z) - 1) < tolerance &&
           fabs(dot(x, y)) < tolerance && fabs(dot(y, z)) < tolerance && fabs(dot(x, z)) < tolerance &&
           dot(across, z) > 0 && x[3] == 0 && y[3] == 0 && z[3] == 0 && values[15] == 1;
}

int is_perspective(const float values[16]) {
    return values[3] == 0 && values[7] == 0 && values[11] == -1 && values[15] == 0 && values[0] != 0 &&
           values[5] != 0 && values[14] != 0;
}
