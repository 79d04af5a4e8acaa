/* An explicit Runge-Kutta method; the one that was chosen at export is in the generated tableau.c.

   k_i = f(t + c_i h, x + h sum_j<i a_ij k_j),  x_new = x + h sum_i b_i k_i,  error = h sum_i e_i k_i.

   Where there is a second estimate E', of lower order, the error is E^2 / sqrt(E^2 + (E'/10)^2). Dense output takes
   further stages behind those of the step. The sums are written out, so that they stay in registers, zeros cost nothing
   and the compiler sees how long they are. */
#ifndef TABLEAU_H
#define TABLEAU_H

#include "restrict.h"
#include "solver.h"

typedef struct {
    int stages;             /* of a step; those of dense output, up to STAGES, come behind */
    int first_same_as_last; /* the last stage is at the end of the step and at x_new: it is the next step's first one */
    const double *c;        /* STAGES */
    int twin;               /* the last stage at the same time as the one before it, 0 if there is none */
} Tableau;

extern const Tableau TABLEAU;

typedef const double (*Stages)[N_STATES]; /* k_i */

/* result[N_STATES] = x + h sum_j a_ij k_j for stage i > 0; x_new for stage i = STAGES, if it is not the last stage. */
void tableau_states(int stage, double h, const double *RESTRICT x, const double (*RESTRICT k)[N_STATES],
                    double *RESTRICT result);

/* error and other[N_STATES] = the two error estimates; 0 for an estimate that the method does not have. */
void tableau_errors(double h, const double (*RESTRICT k)[N_STATES], double *RESTRICT error, double *RESTRICT other);

/* difference[N_STATES] = what the states at the twin and at the stage before it differ by, in units of h. */
void tableau_difference(const double (*RESTRICT k)[N_STATES], double *RESTRICT difference);

/* terms[DENSE_TERMS][N_STATES] of dense_output.h from HERMITE_TERMS on. */
void tableau_dense(double h, const double (*RESTRICT k)[N_STATES], double (*RESTRICT terms)[N_STATES]);

#endif
