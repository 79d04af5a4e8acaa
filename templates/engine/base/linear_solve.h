/* M a = b for the mass matrix M: symmetric, positive definite as a rule, n = N_COORDINATES rows. */
#ifndef LINEAR_SOLVE_H
#define LINEAR_SOLVE_H

#include <stdbool.h>

#include "mechanism.h"

/* Either M = L D L^T (pivoted false): L below the diagonal of factor, its ones not stored, D on the diagonal;
   or P S M S Q = L U (pivoted true): S = diag(scale), P and Q the permutations row and column. Row-major. */
typedef struct {
    bool pivoted;
    double factor[N_COORDINATES * N_COORDINATES];
    double scale[N_COORDINATES];
    int row[N_COORDINATES];
    int column[N_COORDINATES];
} Factorization;

typedef enum { MASS_REGULAR, MASS_SINGULAR, MASS_NOT_FINITE } MassOutcome;

/* Factorises M, mass[n * n], of which the lower triangle is given: as L D L^T, or with pivoting where that does not go
   (Golub, Van Loan, Matrix Computations, 4th edition, sections 4.1 and 3.4). Unless the outcome is MASS_REGULAR,
   concerned[n] flags the coordinates that are not determined or whose rows hold values that are not finite. */
MassOutcome mass_factorize(const double mass[], Factorization *result, bool concerned[]);

/* Has M, in scaled coordinates, a pivot of less than `part` of its largest one? concerned[n] flags the coordinates that
   it leaves nearly undetermined. */
bool mass_nearly_singular(const double mass[], double part, Factorization *work, bool concerned[]);

/* Overwrites b[n] by the solution a of M a = b; work[n] is memory. */
void mass_solve(const Factorization *factorization, double b[], double work[]);

#endif
