/* The matrix of the linear equations of a step where no problem has many rows: it is full. All as in the other
   step_matrix.h, with first = NULL and any least pivot. */
#ifndef STEP_MATRIX_H
#define STEP_MATRIX_H

#include <string.h>

#include "arena.h"
#include "lu.h"

typedef struct {
    int size;
    double *full; /* [size * size] */
    int *order;   /* [size]: its rows as they were pivoted */
} StepMatrix;

static inline size_t step_matrix_bytes(int size, const int first[]) {
    const size_t n = (size_t)size;
    (void)first;
    return arena_bytes(n * n, sizeof(double)) + arena_bytes(n, sizeof(int));
}

static inline StepMatrix step_matrix_take(Arena *arena, int size, const int first[]) {
    const size_t n = (size_t)size;
    (void)first;
    return (StepMatrix){.size = size,
                        .full = (double *)arena_take(arena, n * n * sizeof(double)),
                        .order = (int *)arena_take(arena, n * sizeof(int))};
}

static inline void step_matrix_clear(const StepMatrix *matrix) {
    memset(matrix->full, 0, (size_t)matrix->size * (size_t)matrix->size * sizeof(double));
}

static inline double *step_matrix_entry(const StepMatrix *matrix, int i, int j) {
    return matrix->full + i * matrix->size + j;
}

static inline bool step_matrix_factorize(const StepMatrix *matrix, double least) {
    (void)least;
    return lu_factorize(matrix->full, matrix->order, matrix->size);
}

static inline void step_matrix_solve(const StepMatrix *matrix, const double b[], double x[]) {
    lu_solve(matrix->full, matrix->order, matrix->size, b, x);
}

#endif
