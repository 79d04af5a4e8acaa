/* From the rows of a Problem to the laws that are left without bilateral, sliding and given rows, and back. */
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
    int active;           /* how many rows are unilateral, tangential or bounded */
    int row[MOST_ACTIVE]; /* place among the laws -> row */
    int place[SIZE_ROWS]; /* row -> place among the laws, or -1 */
    int bilateral;        /* how many rows are bilateral */
    int rank;             /* how many of them are independent */
    int order[SIZE_ROWS]; /* place among the bilateral rows -> row, independent ones first */
    double factor[SIZE_ROWS * SIZE_ROWS]; /* L of their L L^T = delassus; SIZE_ROWS entries a row */
} Elimination;

/* Fills all of the laws but the limits of friction. */
void eliminate_rows(const Problem *problem, Elimination *elimination, Laws *laws);

/* Sets the limits of a row of friction among the laws: a coefficient of friction, or the force of a bounded row. */
void set_limit(const Elimination *elimination, int place, double limit, Laws *laws);

/* lambda[rows] and w[rows] for the solution x of the laws. */
void recover_rows(const Elimination *elimination, const double x[], double lambda[], double w[]);

#endif
