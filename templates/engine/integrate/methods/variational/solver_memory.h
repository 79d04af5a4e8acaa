/* The memory of a variational integrator. */
#ifndef SOLVER_MEMORY_H
#define SOLVER_MEMORY_H

#include <stdbool.h>
#include <stdint.h>

#include "changes.h"
#include "sizes.h"

/* The momenta dL/dqd at the present point, and what rounding cut off from the sums of coordinates and momenta. */
typedef struct {
    double momenta[N_COORDINATES];
    double rest_coordinates[N_COORDINATES];
    double rest_momenta[N_COORDINATES];
    int64_t valid; /* nothing but inputs was changed since they were kept */
    int64_t driven; /* inputs that are no motions were changed */
    int64_t moved; /* motion inputs were changed: the velocities do not belong to the momenta yet */
} SolverMemory;

enum { SIZE_NODES = STAGES + 1 };

/* The velocities at the stages and the multipliers at the nodes, and what follows from them: at the stages coordinates,
   momenta dL/dqd and forces F, at the nodes forces and residuals of the constraints. */
typedef struct {
    double velocities[STAGES][N_COORDINATES];
    double coordinates[STAGES][N_COORDINATES];
    double further[STAGES][SIZE_FURTHER]; /* further states */
    double rates[STAGES][SIZE_FURTHER];   /* and their derivatives */
    double momenta[STAGES][N_COORDINATES];
    double forces[STAGES][N_COORDINATES];
    double multipliers[SIZE_NODES][SIZE_CONSTRAINTS]; /* of the last node, whose forces act on no stage, h times it: the
                                                         impulse that ends the step */
    double reactions[SIZE_NODES][N_COORDINATES];      /* G^T multiplier */
    double residuals[SIZE_NODES][SIZE_CONSTRAINTS];   /* phi; of nonholonomic ones the integral of G qd + b */
} SolverScratch;

typedef SolverScratch Stages;

/* Forgets what a change makes invalid. Forces are finite, so that the momenta go on where a support jumps, but the
   velocities do not. */
static inline void solver_forget(SolverMemory *memory, Change change) {
    memory->valid = memory->valid && change != CHANGED_STATE;
    memory->driven = memory->driven || change == CHANGED_INPUT;
    memory->moved = memory->moved || change == CHANGED_MOTION;
}

#endif
