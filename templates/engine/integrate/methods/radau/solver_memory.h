/* The memory of Radau IIA. */
#ifndef SOLVER_MEMORY_H
#define SOLVER_MEMORY_H

#include <stdbool.h>
#include <stdint.h>

#include "changes.h"
#include "sizes.h"

/* What is carried along from step to step. It only makes iterations short: results are right even if it does not fit.
   */
typedef struct {
    int64_t linearized;                              /* stiffness and damping were computed */
    double stiffness[N_RATES * N_COORDINATES];       /* d(qdd, dz/dt)/dq at a point passed, row-major */
    double damping[N_RATES * N_RATES];               /* d(qdd, dz/dt)/d(qd, z) at the same point */
    double contraction;                              /* of the last iterations with them */
    double start, end;                               /* s; of the last step that was solved */
    double length;                                   /* s; of that step, 0: there was none */
    double accelerations[STAGES * N_RATES];          /* at its stages, with the derivatives of further states */
    double start_accelerations[N_RATES];             /* at its start, as the equations say */
    double end_accelerations[N_RATES];               /* at its end, as the equations say */
} SolverMemory;

/* The linearized equations of a step, row-major. */
typedef struct {
    double jacobian[N_STATES * N_RATES];       /* see jacobian.h */
    double real_matrix[N_RATES * N_RATES];     /* of the real mode of the stages */
    double pair_matrix[4 * N_RATES * N_RATES]; /* of their complex pair of modes */
    int real_rows[N_RATES];
    int pair_rows[2 * N_RATES];
    double errors[2][N_STATES]; /* estimates */
} SolverScratch;

/* Nothing has to be forgotten when something changes. */
static inline void solver_forget(SolverMemory *memory, Change change) {
    (void)memory;
    (void)change;
}

#endif
