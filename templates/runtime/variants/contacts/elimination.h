/* From the rows of a Problem to the laws that are left when bilateral, sliding and given rows are eliminated, and back. */
#ifndef ELIMINATION_H
#define ELIMINATION_H

#include "contact_rows.h"
#include "laws.h"
#include "mechanism.h"

/* The problem in scaled rows: lambda = scale times the scaled one, w = the scaled one divided by scale. */
typedef struct {
    const Problem *problem;
    double scale[SIZE_ROWS];
    double delassus[SIZE_ROWS * SIZE_ROWS]; /* rows entries a row */
    double free[SIZE_ROWS];
    int active;       /* unilateral, tangential and bounded rows: ... */
    int row[MOST_ACTIVE];  /* ... place among the laws -> row */
    int place[SIZE_ROWS];     /* row -> place among the laws, or -1 */
    int bilateral;    /* bilateral rows: ... */
    int order[SIZE_ROWS];     /* ... place -> row, independent ones first */
    int rank;         /* how many of them are independent */
    double factor[SIZE_ROWS * SIZE_ROWS]; /* L of L L^T = delassus of the independent bilateral rows; SIZE_ROWS entries a row */
} Elimination;

/* Fills all of the laws but the limits of friction. */
void eliminate_rows(const Problem *problem, Elimination *elimination, Laws *laws);

/* Sets the limits of a row of friction among the laws: a coefficient of friction, or the force of a bounded row. */
void set_limit(const Elimination *elimination, int place, double limit, Laws *laws);

/* lambda[rows] and w[rows] for the solution x of the laws. */
void recover_rows(const Elimination *elimination, const double x[], double lambda[], double w[]);

#endif
