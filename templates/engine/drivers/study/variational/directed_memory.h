/* What directions need in steps of a variational method. */
#ifndef DIRECTED_MEMORY_H
#define DIRECTED_MEMORY_H

#include "sizes.h"

enum { STEPS_HOLD_SAMPLES = 0 }; /* steps end at samples: their interpolant is of low order */

/* The unknowns of a step: velocities and rates of further states at the stages, multipliers at the nodes, velocities at
   its end. */
enum { SIZE_OF_STEP = STAGES * N_RATES + (STAGES + 1) * N_CONSTRAINTS + N_COORDINATES };

/* The linearized equations of a step, row-major, and vectors of their size. */
typedef struct {
    double matrix[SIZE_OF_STEP * SIZE_OF_STEP];
    int rows[SIZE_OF_STEP];
    double jacobian[N_STATES * N_RATES]; /* see jacobian.h */
    double right[SIZE_OF_STEP], change[SIZE_OF_STEP];
} DirectedMemory;

#endif
