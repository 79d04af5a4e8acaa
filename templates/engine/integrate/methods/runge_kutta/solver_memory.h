/* The memory of an explicit Runge-Kutta method. */
#ifndef SOLVER_MEMORY_H
#define SOLVER_MEMORY_H

#include "mechanism.h"
#include "no_memory.h"

typedef struct {
    double stages[STAGES][N_STATES]; /* dx/dt at the stages of a trial step and of dense output */
} SolverScratch;

#endif
