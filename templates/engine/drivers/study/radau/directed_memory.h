/* What directions need beside their stages in steps of Radau IIA. */
#ifndef DIRECTED_MEMORY_H
#define DIRECTED_MEMORY_H

#include "solver_memory.h"

/* Steps end at samples: the interpolant is smoothed by what the iterations know of the equations, and would bring in
   derivatives of that. */
enum { STEPS_HOLD_SAMPLES = 0 };

/* The linearized equations of all stages of a step, row-major. */
typedef struct {
    double matrix[STAGES * N_RATES * STAGES * N_RATES];
    int rows[STAGES * N_RATES];
    double jacobian[N_STATES * N_RATES]; /* see jacobian.h */
} DirectedMemory;

#endif
