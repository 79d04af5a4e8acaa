/* Many contacts of which each touches few others: a sparse Delassus operator and the order of its elimination. */
#ifndef SPARSE_ROWS_H
#define SPARSE_ROWS_H

#include <stdbool.h>

#include "contact_rows.h"

/* The rows of a contact follow each other: that of its normal, then one or two tangential ones. */
typedef struct {
    int rows;
    const int *start;    /* [rows + 1]: entries start[k] to start[k + 1] - 1 are those of row k */
    const int *column;   /* ascending in each row; the diagonal entry is always there */
    const double *value; /* symmetric, positive semidefinite */
    const double *free;  /* [rows] */
    const Row *row;      /* [rows]; no sliding rows, and holding, value of unilateral rows and holds are not used */
} SparseProblem;

/* Rows that belong together: those of a contact, or a single one. The arrays have rows (+ 1) entries. */
typedef struct {
    int count;
    int *start;  /* unit -> its first row; start[count] = rows */
    int *unit;   /* row -> its unit */
    int *order;  /* units in the order of elimination */
    int *degree; /* unit -> how many entries its rows have */
    int *place;  /* row -> its place in the elimination */
    int *first;  /* place -> the first place of its envelope */
    int *offset; /* place -> where its envelope is stored, less first */
} Units;

/* Finds units, order and envelope; returns how many entries the envelope has on each side. The order is that of Cuthill
   and McKee, Reducing the bandwidth of sparse symmetric matrices, 1969, reversed: George, Liu, Computer Solution of
   Large Sparse Positive Definite Systems, 1981, chapter 4. */
int units_order(const SparseProblem *problem, Units *units);

#endif
