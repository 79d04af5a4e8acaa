/* The matrix of the linear equations of a step: full for few rows, within an envelope for many. */
#ifndef STEP_MATRIX_H
#define STEP_MATRIX_H

#include <stdbool.h>

#include "envelope.h"

typedef struct {
    int size;
    double *full;      /* [size * size], or NULL: the entries are in the envelope */
    int *order;        /* [size]: its rows as they were pivoted */
    Envelope envelope; /* if it is not full */
} StepMatrix;

/* Bytes of such a matrix, for a reservation; first[size] says where the rows of an envelope begin, NULL: it is full. */
size_t step_matrix_bytes(int size, const int first[]);

/* A matrix of the arena, with undefined entries. */
StepMatrix step_matrix_take(Arena *arena, int size, const int first[]);

/* All entries become 0. */
void step_matrix_clear(const StepMatrix *matrix);

static inline void step_matrix_add(const StepMatrix *matrix, int i, int j, double value) {
    double *full = matrix->full;
    *(full != NULL ? full + i * matrix->size + j : envelope_entry(&matrix->envelope, i, j)) += value;
}

/* Overwrites the entries by factors; a full matrix is pivoted. False: it is singular, as it is if a pivot within an
   envelope is less than least. */
bool step_matrix_factorize(const StepMatrix *matrix, double least);

/* x[size] for b[size]. */
void step_matrix_solve(const StepMatrix *matrix, const double b[], double x[]);

#endif
