/* Matrices of which only some entries are stored, row by row. */
#ifndef SPARSE_H
#define SPARSE_H

#include "arena.h"

typedef struct {
    int rows;
    int *start;  /* [rows + 1]: entries start[i] to start[i + 1] - 1 are those of row i */
    int *column;
    double *value;
} Sparse;

/* Bytes of such a matrix, for a reservation. */
size_t sparse_bytes(size_t rows, size_t entries);

/* A matrix of the arena with room for `entries` entries, none of which is set; start[0] = 0. */
Sparse sparse_take(Arena *arena, int rows, int entries);

/* The same with all entries: that of row i and column j is value[i * columns + j], 0 at first. */
Sparse sparse_full(Arena *arena, int rows, int columns);

/* product[rows] = matrix x. */
void sparse_multiply(const Sparse *matrix, const double x[], double product[]);

#endif
