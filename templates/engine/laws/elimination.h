/* From the rows of a Problem to the laws that are left without bilateral, sliding and given rows, and back. */
#ifndef ELIMINATION_H
#define ELIMINATION_H

#include "islands.h"
#include "laws.h"

/* The problem in scaled rows: lambda = scale times the scaled one, w = the scaled one divided by scale. */
typedef struct {
    const Problem *problem;
    const double *scale;  /* [rows] */
    double *free;         /* [rows] */
    int kept;             /* how many rows of the island are not free: matrices are as large as what takes part */
    int *row_kept;        /* [kept]: place among them -> row */
    int *place_kept;      /* [rows]: row -> place among them, or -1 */
    double *delassus;     /* [kept * kept] */
    int active;           /* how many rows are unilateral, tangential or bounded */
    int *row;             /* [active]: place among the laws -> row */
    int *place;           /* [rows]: row -> place among the laws, or -1 */
    int bilateral;        /* how many rows are bilateral */
    int rank;             /* how many of them are independent */
    int *order;           /* [bilateral]: place among the bilateral rows -> row, independent ones first */
    double *factor;       /* [bilateral * bilateral]: L of their L L^T = delassus */
} Elimination;

/* Takes the elimination and the laws of an island from the arena, and fills all of them but the limits of friction.
   Returns false, with arena->refused, if there is no memory for them and for their solution but for central_path.h. */
bool eliminate_rows(const Problem *problem, const Islands *islands, int which, Elimination *elimination, Laws *laws);

/* Sets the limits of a row of friction among the laws: a coefficient of friction, or the force of a bounded row. */
void set_limit(const Elimination *elimination, int place, double limit, Laws *laws);

/* Sets lambda[rows] of the rows that are kept, for the solution x of the laws. */
void recover_rows(const Elimination *elimination, const double x[], double lambda[]);

#endif
