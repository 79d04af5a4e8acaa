/* Looking at the mass matrix where something goes wrong. */
#include "diagnosis.h"

#include <math.h>

#include "failure.h"
#include "mass_matrix.h"
#include "massless.h"
#include "scale.h"

/* In units of |qd| + nominal: an acceleration is sudden if it changes a velocity by more in a default solver step. M is
   then looked at, which may be about to become singular; usual motions change by a fraction of 1. */
static const double SUDDEN = 10.0;

/* A part of the largest pivot. Where M has a smaller pivot at the start already, as with light bodies, a small pivot
   later tells of no singularity. */
static const double REGULAR = 0.1;

void explain_failure(Instance *instance) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_ZEROS(mark, bool, concerned, N_COORDINATES);
    const double *states = instance->state.states;
    if (instance->failure.kind == FAILURE_ACCURACY && mass_about_to_vanish(instance, states, SINGULAR_NOW, concerned)) {
        report_coordinates(instance, FAILURE_SINGULAR, instance->state.time, concerned);
    }
    massless_explain_failure(instance);
    arena_release(mark);
}

bool runs_into_singularity(Instance *instance, const double accelerations[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_ZEROS(mark, bool, concerned, N_COORDINATES);
    const double *states = instance->state.states, *velocities = states + N;
    bool sudden = false;
    for (int i = 0; i < N; i++) {
        const double usual = (fabs(velocities[i]) + NOMINAL_STATES[N + i]) / DEFAULT_SOLVER_STEP;
        sudden = sudden || fabs(accelerations[i]) > SUDDEN * usual;
    }
    return arena_leave(mark, sudden && mass_about_to_vanish(instance, states, SINGULAR_SOON, concerned) &&
                                 !report_coordinates(instance, FAILURE_NEARLY_SINGULAR, instance->state.time,
                                 concerned));
}

bool leaps_over_singularity(Instance *instance, double length) {
    const double *old = instance->state.states, *next = instance->scratch.new_states;
    bool leaps = false;
    for (int i = N; i < 2 * N; i++) {
        const double change = next[i] - old[i];
        const double mean = 0.5 * (instance->state.first_stage[i] + instance->scratch.new_derivatives[i]);
        leaps = leaps || fabs(change - length * mean) > fabs(change) + fabs(old[i]) + NOMINAL_STATES[i];
    }
    if (!leaps) {
        return false;
    }
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_ZEROS(mark, bool, concerned, N_COORDINATES);
    WORK_ZEROS(mark, bool, ignored, N_COORDINATES);
    return arena_leave(mark, (mass_about_to_vanish(instance, old, SINGULAR_NEAR, concerned) ||
                              mass_about_to_vanish(instance, next, SINGULAR_NEAR, concerned)) &&
                                 !mass_about_to_vanish(instance, START_STATES, REGULAR, ignored) &&
                                 !report_coordinates(instance, FAILURE_SINGULAR, instance->state.time, concerned));
}
