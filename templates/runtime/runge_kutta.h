/* An explicit Runge-Kutta method as data; the one that was chosen at export is in the generated tableau.c.

   k_i = f(t + c_i h, x + h sum_j<i a_ij k_j),  x_new = x + h sum_i b_i k_i,  error = h sum_i e_i k_i. */
#ifndef RUNGE_KUTTA_H
#define RUNGE_KUTTA_H

typedef struct {
    const char *name;
    int stages;
    int order;              /* of x_new */
    int error_order;        /* of the embedded solution x_new - error; not used by fixed-step methods */
    int first_same_as_last; /* the last row of a is b and c ends with 1: the last stage is the next step's first */
    const double *a;        /* stages x stages, row-major, strictly lower triangular */
    const double *b;        /* stages */
    const double *c;        /* stages */
    const double *e;        /* stages; b minus the weights of the embedded solution, NULL: a fixed-step method */
} Tableau;

extern const Tableau TABLEAU;

#endif
