/* Small dense linear equations that may be singular. */
#ifndef LEAST_NORM_H
#define LEAST_NORM_H

#include "arena.h"

/* The solution x[n] of least norm of a x = b in the sense of least squares; a[n * n] is row-major, its entries are of
   the order of 1. Its rank is that to rounding. Golub, Van Loan, Matrix Computations, 4th edition,
   sections 5.4.2 (orthogonal decomposition with column pivoting) and 5.5.2 (least norm). */
void least_norm_solve(Arena *arena, int n, const double a[], const double b[], double x[]);

/* Of all such solutions in the sense of least squares the one to which that of (a + e) x = b tends with e to 0, as of
   rows that give way alike: y^T x = 0 for all y with y^T a = 0. For a symmetric a it is that of least norm. a[n * n]
   and b[n] are changed. */
void even_solve(Arena *arena, int n, double a[], double b[], double x[]);

#endif
