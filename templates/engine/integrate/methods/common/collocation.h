/* An implicit Runge-Kutta method as data; the one that was chosen at export is in the generated collocation.c.

   Stages i at the times t + c_i h hold Q_i = q + h sum_j a_ij V_j; what changes the velocities (accelerations, or
   forces that change momenta) is summed with hat_ij in the same way, and both with b_j over the whole step. hat is a
   itself unless the method is partitioned. */
#ifndef COLLOCATION_H
#define COLLOCATION_H

#include "mechanism.h"

enum { S = STAGES };

typedef struct {
    int stages;
    const double *a;   /* stages x stages, row-major */
    const double *hat; /* stages x stages */
    const double *b;   /* stages */
    const double *c;   /* stages */
} Collocation;

extern const Collocation COLLOCATION;

/* Where constraints hold within a step of a variational method: at nodes with the times t + c_i h and the coordinates
   q + h sum_j a_ij V_j, the first at its start and the last at its end. Their forces at the nodes add up to momenta
   with hat_ij at the stages, and with b_j over the whole step. */
typedef struct {
    int count;
    const double *a;       /* count x stages, row-major */
    const double *hat;     /* stages x count; the last column is 0 */
    const double *b;       /* count */
    const double *c;       /* count */
    const double *weights; /* the inverse of a hat without its first row and its last column */
} Nodes;

extern const Nodes NODES;

/* For radau5: a = from_modes diag(real, pair) to_modes. Its stages, combined by to_modes, do not meet in the linear
   systems, except for the two stages of the pair. */
typedef struct {
    double real;
    const double *squared; /* a a, 3 x 3 */
    const double *pair; /* 2 x 2 */
    const double *to_modes; /* 3 x 3 */
    const double *from_modes;
} Modes;

extern const Modes MODES;

#endif
