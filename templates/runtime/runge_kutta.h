/* An explicit Runge-Kutta method as data; the one that was chosen at export is in the generated tableau.c.

   k_i = f(t + c_i h, x + h sum_j<i a_ij k_j),  x_new = x + h sum_i b_i k_i,  error = h sum_i e_i k_i.

   Where there is a second estimate E' with weights second_i, of lower order, the error is E^2 / sqrt(E^2 + (E'/10)^2).
   Dense output takes further stages, rows of a and c behind those of the step. */
#ifndef RUNGE_KUTTA_H
#define RUNGE_KUTTA_H

typedef struct {
    int stages;             /* of a step */
    int all_stages;         /* and of dense output */
    int first_same_as_last; /* the last row of the step in a is b and its c is 1: it is the next step's first stage */
    const double *a;        /* all_stages x all_stages, row-major, strictly lower triangular */
    const double *b;        /* stages */
    const double *c;        /* all_stages */
    const double *e;        /* stages; b minus the weights of the embedded solution, NULL: a fixed-step method */
    const double *second;   /* stages, NULL: there is none */
    const double *dense;    /* DENSE_ROWS x all_stages: the terms h sum_i dense_ji k_i of dense_output.h */
    double stability;       /* steps h for dx/dt = -x do not grow up to this h */
} Tableau;

extern const Tableau TABLEAU;

#endif
