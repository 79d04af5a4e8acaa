#include "sparse.h"

#include <string.h>

size_t sparse_bytes(size_t rows, size_t entries) {
    return arena_bytes(rows + 1, sizeof(int)) + arena_bytes(entries, sizeof(int)) +
           arena_bytes(entries, sizeof(double));
}

Sparse sparse_take(Arena *arena, int rows, int entries) {
    const size_t n = (size_t)rows, count = (size_t)entries;
    const Sparse matrix = {.rows = rows,
                           .start = (int *)arena_take(arena, (n + 1) * sizeof(int)),
                           .column = (int *)arena_take(arena, count * sizeof(int)),
                           .value = (double *)arena_take(arena, count * sizeof(double))};
    matrix.start[0] = 0;
    return matrix;
}

Sparse sparse_full(Arena *arena, int rows, int columns) {
    const Sparse matrix = sparse_take(arena, rows, rows * columns);
    for (int i = 0; i < rows; i++) {
        for (int j = 0; j < columns; j++) {
            matrix.column[i * columns + j] = j;
        }
        matrix.start[i + 1] = (i + 1) * columns;
    }
    memset(matrix.value, 0, (size_t)(rows * columns) * sizeof(double));
    return matrix;
}

void sparse_multiply(const Sparse *matrix, const double x[], double product[]) {
    for (int i = 0; i < matrix->rows; i++) {
        double sum = 0.0;
        for (int e = matrix->start[i]; e < matrix->start[i + 1]; e++) {
            sum += matrix->value[e] * x[matrix->column[e]];
        }
        product[i] = sum;
    }
}
