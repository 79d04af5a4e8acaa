#include "step_matrix.h"

#include <string.h>

#include "lu.h"

size_t step_matrix_bytes(int size, const int first[]) {
    const size_t n = (size_t)size;
    return first == NULL ? arena_bytes(n * n, sizeof(double)) + arena_bytes(n, sizeof(int))
                         : envelope_bytes(size, first);
}

StepMatrix step_matrix_take(Arena *arena, int size, const int first[]) {
    const size_t n = (size_t)size;
    StepMatrix matrix = {.size = size, .full = NULL};
    if (first == NULL) {
        matrix.full = (double *)arena_take(arena, n * n * sizeof(double));
        matrix.order = (int *)arena_take(arena, n * sizeof(int));
    } else {
        matrix.envelope = envelope_take(arena, size, first);
    }
    return matrix;
}

void step_matrix_clear(const StepMatrix *matrix) {
    const size_t n = (size_t)matrix->size;
    if (matrix->full != NULL) {
        memset(matrix->full, 0, n * n * sizeof(double));
    } else {
        envelope_clear(&matrix->envelope);
    }
}

bool step_matrix_factorize(const StepMatrix *matrix, double least) {
    return matrix->full != NULL ? lu_factorize(matrix->full, matrix->order, matrix->size)
                                : envelope_factorize(&matrix->envelope, least);
}

void step_matrix_solve(const StepMatrix *matrix, const double b[], double x[]) {
    if (matrix->full != NULL) {
        lu_solve(matrix->full, matrix->order, matrix->size, b, x);
        return;
    }
    memcpy(x, b, (size_t)matrix->size * sizeof(double));
    envelope_solve(&matrix->envelope, x);
}
