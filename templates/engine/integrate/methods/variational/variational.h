/* A step of a variational method: its stages, and what holonomic constraints add to them, see variational.c. The
   functions are those of variational_constraints.c or, where there are no constraints, variational_free.c. */
#ifndef VARIATIONAL_H
#define VARIATIONAL_H

#include <string.h>

#include "collocation.h"
#include "solver.h"

/* The time (s) at a part of the step, which is 1 at its very end. */
static inline double time_within(const Instance *instance, Step step, double part) {
    return part == 1.0 ? step.end : instance->state.time + part * step.length;
}

/* states = [q, qd, z] at stage i */
static inline void stage_states(const Stages *stages, int i, double states[]) {
    memcpy(states, stages->coordinates[i], N_COORDINATES * sizeof(double));
    memcpy(states + N_COORDINATES, stages->velocities[i], N_COORDINATES * sizeof(double));
    memcpy(states + 2 * N_COORDINATES, stages->further[i], N_FURTHER * sizeof(double));
}

/* The multipliers to begin with: those at the start of the step, where the system is factorised. */
void stages_guess_multipliers(const System *system, Stages *stages);

/* Sets the forces and the residuals of the constraints at the nodes, as velocities and multipliers have them. */
void stages_constrain(Instance *instance, Step step, Stages *stages);

/* The constraints' force on a coordinate that adds up to its momentum at stage i, or at the end for i = STAGES, times
   the length of the step. */
double stages_reaction(const Stages *stages, int i, int coordinate);

/* Corrects the multipliers such that the residuals vanish, to first order. Before, changes[i] are those of
   velocities that leave G qd as it is, with multipliers behind them; after, those that belong to the corrected
   multipliers. h is the length of the step. */
void stages_meet_constraints(const System *system, double h, Stages *stages, double changes[STAGES][N_UNKNOWNS]);

/* Changes the velocities in states, at this time (s), so that their momenta grow by missing[n] and an impulse of the
   constraints, which is added to impulse[n], and G qd + dphi/dt = 0. The system is factorised there. */
void stages_end_step(Instance *instance, double time, const double missing[], double states[], double impulse[]);

/* Is M regular? Where it is singular and only constraints make the system regular, momenta do not tell the velocities:
   returns false there, with instance->failure. */
bool mass_regular(Instance *instance, double time, const double states[], const System *system);

/* Do the constraints hold after the step? They do not if a redundant one that was left out was needed. */
bool new_states_on_constraints(Instance *instance, Step step);

#endif
