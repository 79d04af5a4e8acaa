/* The memory of ROS2. */
#ifndef SOLVER_MEMORY_H
#define SOLVER_MEMORY_H

#include "mechanism.h"
#include "no_memory.h"
#include "sizes.h"

typedef struct {
    double stages[STAGES][N_STATES]; /* k1 and k2 */
    double jacobian[N_STATES * N_RATES]; /* see jacobian.h */
    double matrix[N_RATES * N_RATES];    /* of the systems of a step, factorised */
    int rows[N_RATES];                   /* their order in it, see lu.h */
    double missed; /* what the linearization missed of the last step, see solver_stiffness */
} SolverScratch;

#endif
