/* Looking at the mass matrix where something goes wrong. */
#include "diagnosis.h"

#include <math.h>

#include "failure.h"
#include "mass_matrix.h"
#include "massless.h"

enum { N = N_COORDINATES };

/* A pivot below this part of the largest one explains why a solver cannot go on. */
static const double EXPLAINS = 1e-6;

/* A pivot below this part of the largest one may soon be the reason why a solver cannot go on. */
static const double FORETELLS = 1e-4;

/* M is about to become singular if velocities change by so many times their size in a usual solver step. */
static const double SUDDEN = 10.0;

/* A fixed step may leap over a singular M if a pivot at one of its ends is below this part of the largest one. */
static const double LEAPT_OVER = 1e-2;

/* If a pivot at the start is below this part of the largest one, as for light bodies, small pivots say nothing. */
static const double REGULAR = 0.1;

void explain_failure(Instance *instance) {
    const double *states = instance->state.states;
    bool concerned[N_COORDINATES] = {false};
    if (instance->failure.kind == FAILURE_ACCURACY && mass_about_to_vanish(instance, states, EXPLAINS, concerned)) {
        report_coordinates(instance, FAILURE_SINGULAR, instance->state.time, concerned);
    }
    massless_explain_failure(instance);
}

bool runs_into_singularity(Instance *instance, const double accelerations[]) {
    const double *states = instance->state.states, *velocities = states + N;
    bool concerned[N_COORDINATES] = {false};
    bool sudden = false;
    for (int i = 0; i < N; i++) {
        const double usual = (fabs(velocities[i]) + NOMINAL_STATES[N + i]) / DEFAULT_SOLVER_STEP;
        sudden = sudden || fabs(accelerations[i]) > SUDDEN * usual;
    }
    return sudden && mass_about_to_vanish(instance, states, FORETELLS, concerned) &&
           !report_coordinates(instance, FAILURE_NEARLY_SINGULAR, instance->state.time, concerned);
}

bool leaps_over_singularity(Instance *instance, double length) {
    const double *old = instance->state.states, *new = instance->scratch.new_states;
    bool concerned[N_COORDINATES] = {false}, ignored[N_COORDINATES] = {false};
    bool leaps = false;
    for (int i = N; i < 2 * N; i++) {
        const double change = new[i] - old[i];
        const double mean = 0.5 * (instance->state.first_stage[i] + instance->scratch.new_derivatives[i]);
        leaps = leaps || fabs(change - length * mean) > fabs(change) + fabs(old[i]) + NOMINAL_STATES[i];
    }
    return leaps &&
           (mass_about_to_vanish(instance, old, LEAPT_OVER, concerned) ||
            mass_about_to_vanish(instance, new, LEAPT_OVER, concerned)) &&
           !mass_about_to_vanish(instance, START_STATES, REGULAR, ignored) &&
           !report_coordinates(instance, FAILURE_SINGULAR, instance->state.time, concerned);
}
