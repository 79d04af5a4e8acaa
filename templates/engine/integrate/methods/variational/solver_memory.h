/* The memory of a variational integrator. */
#ifndef SOLVER_MEMORY_H
#define SOLVER_MEMORY_H

#include <stdbool.h>
#include <stdint.h>

#include "mechanism.h"

/* The momenta dL/dqd at the present point, and what rounding cut off from the sums of coordinates and momenta. */
typedef struct {
    double momenta[N_COORDINATES];
    double rest_coordinates[N_COORDINATES];
    double rest_momenta[N_COORDINATES];
    int64_t valid; /* nothing but motion inputs was changed since they were kept */
    int64_t moved; /* motion inputs were changed: the velocities do not belong to the momenta yet */
} SolverMemory;

typedef struct {
    int none; /* C has no struct without members */
} SolverScratch;

/* Forgets what a change makes invalid; motion: a motion input was changed. Forces are finite, so that the momenta go on
   where a support jumps, but the velocities do not. */
static inline void solver_forget(SolverMemory *memory, bool motion) {
    if (motion) {
        memory->moved = 1;
    } else {
        memory->valid = 0;
    }
}

#endif
