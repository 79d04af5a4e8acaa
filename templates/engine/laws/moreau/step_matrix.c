/* Elimination within an envelope: all inner loops run along stored rows of L and columns of U. */
#include "step_matrix.h"

#include <math.h>
#include <string.h>

#include "lu.h"

static size_t entries_of(int size, const int first[]) {
    size_t entries = 0;
    for (int i = 0; i < size; i++) {
        entries += (size_t)(i + 1 - first[i]);
    }
    return entries;
}

size_t step_matrix_bytes(int size, const int first[]) {
    const size_t n = (size_t)size;
    return arena_bytes(n, sizeof(int)) + (first == NULL ? arena_bytes(n * n, sizeof(double))
                                                        : 2 * arena_bytes(entries_of(size, first), sizeof(double)));
}

StepMatrix step_matrix_take(Arena *arena, int size, const int first[]) {
    const size_t n = (size_t)size;
    int *rows = (int *)arena_take(arena, n * sizeof(int));
    if (first == NULL) {
        return (StepMatrix){
            .size = size, .full = (double *)arena_take(arena, n * n * sizeof(double)), .order = rows};
    }
    const size_t bytes = entries_of(size, first) * sizeof(double);
    for (int i = 0, entries = 0; i < size; i++) {
        rows[i] = entries - first[i];
        entries += i + 1 - first[i];
    }
    return (StepMatrix){.size = size,
                        .first = first,
                        .offset = rows,
                        .lower = (double *)arena_take(arena, bytes),
                        .upper = (double *)arena_take(arena, bytes)};
}

void step_matrix_clear(const StepMatrix *matrix) {
    const size_t n = (size_t)matrix->size;
    if (matrix->full != NULL) {
        memset(matrix->full, 0, n * n * sizeof(double));
        return;
    }
    const size_t bytes = entries_of(matrix->size, matrix->first) * sizeof(double);
    memset(matrix->lower, 0, bytes);
    memset(matrix->upper, 0, bytes);
}

/* The sum of row i of L times column j of U, up to place end. */
static double product_of_rows(const StepMatrix *e, int i, int j, int end) {
    const int start = e->first[i] > e->first[j] ? e->first[i] : e->first[j];
    const double *row = e->lower + e->offset[i], *column = e->upper + e->offset[j];
    double sum = 0.0;
    for (int k = start; k < end; k++) {
        sum += row[k] * column[k];
    }
    return sum;
}

bool step_matrix_factorize(const StepMatrix *matrix, double least) {
    if (matrix->full != NULL) {
        return lu_factorize(matrix->full, matrix->order, matrix->size);
    }
    bool regular = true;
    for (int i = 0; i < matrix->size && regular; i++) {
        for (int j = matrix->first[i]; j < i; j++) {
            *step_matrix_entry(matrix, j, i) -= product_of_rows(matrix, j, i, j);
            double *entry = step_matrix_entry(matrix, i, j);
            *entry = (*entry - product_of_rows(matrix, i, j, j)) / *step_matrix_entry(matrix, j, j);
        }
        double *pivot = step_matrix_entry(matrix, i, i);
        *pivot -= product_of_rows(matrix, i, i, i);
        regular = fabs(*pivot) >= least;
    }
    return regular;
}

void step_matrix_solve(const StepMatrix *matrix, const double b[], double x[]) {
    if (matrix->full != NULL) {
        lu_solve(matrix->full, matrix->order, matrix->size, b, x);
        return;
    }
    memcpy(x, b, (size_t)matrix->size * sizeof(double));
    for (int i = 0; i < matrix->size; i++) {
        for (int j = matrix->first[i]; j < i; j++) {
            x[i] -= *step_matrix_entry(matrix, i, j) * x[j];
        }
    }
    for (int i = matrix->size - 1; i >= 0; i--) {
        x[i] /= *step_matrix_entry(matrix, i, i);
        for (int j = matrix->first[i]; j < i; j++) {
            x[j] -= *step_matrix_entry(matrix, j, i) * x[i];
        }
    }
}
