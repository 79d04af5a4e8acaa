/* The matrix of the linear equations of a step: full for few rows; for many sparse, within an envelope, where row i and
   column i begin at first[i]. */
#ifndef STEP_MATRIX_H
#define STEP_MATRIX_H

#include <stdbool.h>

#include "arena.h"

/* lower[offset[i] + j] is entry (i, j) for j < i, upper[offset[i] + j] is entry (j, i) for j <= i; j >= first[i]. */
typedef struct {
    int size;
    double *full;     /* [size * size], or NULL: the entries are within the envelope */
    int *order;       /* [size]: the rows of a full matrix as they were pivoted */
    const int *first; /* [size], of the caller, by which the envelope is symmetric */
    int *offset;      /* [size] */
    double *lower;
    double *upper;
} StepMatrix;

/* Bytes of such a matrix, for a reservation; first[size] says where the rows of an envelope begin, NULL: it is full. */
size_t step_matrix_bytes(int size, const int first[]);

/* A matrix of the arena, with undefined entries. */
StepMatrix step_matrix_take(Arena *arena, int size, const int first[]);

/* All entries become 0. */
void step_matrix_clear(const StepMatrix *matrix);

/* Where entry (i, j) is stored, which is within the envelope if there is one. */
static inline double *step_matrix_entry(const StepMatrix *matrix, int i, int j) {
    return matrix->full != NULL ? matrix->full + i * matrix->size + j
           : j < i              ? matrix->lower + matrix->offset[i] + j
                                : matrix->upper + matrix->offset[j] + i;
}

/* Overwrites the entries by L and U, the diagonal entries of L being 1 and not stored. A full matrix is pivoted. False:
   it is singular, as it is if a pivot within an envelope is less than least. George, Liu, Computer Solution of Large
   Sparse Positive Definite Systems, 1981, chapter 4. */
bool step_matrix_factorize(const StepMatrix *matrix, double least);

/* x[size] for b[size]. */
void step_matrix_solve(const StepMatrix *matrix, const double b[], double x[]);

#endif
