/* Evaluating and factorising the mass matrix. */
#include "mass_matrix.h"

#include <math.h>
#include <string.h>

#include "failure.h"
#include "scale.h"

/* Brings the least acceptable pivots up to date: relative to the diagonal of M at the start, with the present
   parameters, so that they follow from the State and a restored run repeats itself. */
static const double *least_pivots(Instance *instance) {
    Cache *cache = &instance->cache;
    const State *state = &instance->state;
    if (!cache->least_pivots_valid) {
        double *mass = instance->scratch.mass;
        mechanism_dynamics(state->start_time, START_STATES, START_INPUTS, state->parameters, mass,
                           instance->scratch.forcing);
        for (int i = 0; i < N; i++) {
            const double inertia = fabs(mass[i * N + i]);
            cache->least_pivots[i] = isfinite(inertia) ? PIVOT_SUSPICIOUS * inertia : 0.0;
        }
        cache->least_pivots_valid = true;
    }
    return cache->least_pivots;
}

bool pivots_sound(Instance *instance, const double pivots[]) {
    const double *least = least_pivots(instance);
    for (int i = 0; i < N; i++) {
        if (!(pivots[i] > least[i])) {
            return false;
        }
    }
    return true;
}

MassOutcome mass_evaluate(Instance *instance, double time, const double states[], const double inputs[],
                          System *system, bool concerned[]) {
    double *mass = instance->scratch.mass;
    mechanism_dynamics(time, states, inputs, instance->state.parameters, mass, instance->scratch.forcing);
    return mass_factorize(mass, &system->pivoted, concerned);
}

bool mass_accept(Instance *instance, MassOutcome outcome, double time, const bool concerned[]) {
    return outcome == MASS_REGULAR ||
           report_coordinates(instance, outcome == MASS_SINGULAR ? FAILURE_SINGULAR : FAILURE_NOT_FINITE, time,
                              concerned);
}

void mass_divide(const System *system, const double b[], double a[]) {
    if (system->dense) {
        memcpy(a, b, N * sizeof(double));
        const ArenaMark mark = arena_mark(system->arena);
        WORK(mark, double, work, N);
        mass_solve(&system->pivoted, a, work);
        arena_release(mark);
    } else {
        mechanism_solve(system->factor, b, a);
    }
}

bool mass_about_to_vanish(Instance *instance, const double states[], double part, bool concerned[]) {
    const State *state = &instance->state;
    if (N_CONSTRAINTS > 0) {
        return false;
    }
    mechanism_dynamics(state->time, states, state->inputs, state->parameters, instance->scratch.mass,
                       instance->scratch.forcing);
    return mass_nearly_singular(instance->scratch.mass, part, &instance->scratch.system.pivoted, concerned);
}
