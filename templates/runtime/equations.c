/* Evaluating the generated functions of mechanism.h, at the present point and at the stages of the solver.

   The generated code solves M qdd = f without pivoting, in an order that suits the mechanism, and reports its pivots.
   Where one of them is no better than rounding error, the dense solver of linear_solve.h takes over. */
#include "equations.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* A pivot below the inertia of its coordinate times this is suspicious; the dense solver decides. */
static const double SUSPICIOUS = 1e4 * DBL_EPSILON;

/* Brings the least acceptable pivots up to date: relative to the diagonal of M at the start, with the present
   parameters, so that they follow from the State and a restored run repeats itself. */
static const double *least_pivots(Instance *instance) {
    Cache *cache = &instance->cache;
    const State *state = &instance->state;
    if (!cache->least_pivots_valid) {
        double *mass = instance->scratch.mass;
        mechanism_dynamics(state->start_time, START_STATES, START_INPUTS, state->parameters, mass,
                           instance->scratch.forcing);
        for (int i = 0; i < N_COORDINATES; i++) {
            const double inertia = fabs(mass[i * N_COORDINATES + i]);
            cache->least_pivots[i] = isfinite(inertia) ? SUSPICIOUS * inertia : 0.0;
        }
        cache->least_pivots_valid = true;
    }
    return cache->least_pivots;
}

/* Are all pivots clearly positive? False for a NaN. */
static bool pivots_sound(Instance *instance, const double pivots[]) {
    const double *least = least_pivots(instance);
    for (int i = 0; i < N_COORDINATES; i++) {
        if (!(pivots[i] > least[i])) {
            return false;
        }
    }
    return true;
}

/* Are all values finite? Flags those that are not. */
static bool all_finite(const double values[], bool concerned[]) {
    bool finite = true;
    for (int i = 0; i < N_COORDINATES; i++) {
        concerned[i] = !isfinite(values[i]);
        finite = finite && !concerned[i];
    }
    return finite;
}

static bool report(Instance *instance, FailureKind kind, double time, const bool concerned[]) {
    instance->failure.kind = kind;
    instance->failure.time = time;
    memcpy(instance->failure.coordinates, concerned, sizeof instance->failure.coordinates);
    return false;
}

/* The cold path: M is written out and factorised with pivoting where it must be. Leaves the forcing in scratch. */
static bool factorize_densely(Instance *instance, double time, const double states[], Factorization *factorization) {
    const State *state = &instance->state;
    bool concerned[N_COORDINATES] = {false};
    mechanism_dynamics(time, states, state->inputs, state->parameters, instance->scratch.mass,
                       instance->scratch.forcing);
    const MassOutcome outcome = mass_factorize(instance->scratch.mass, factorization, concerned);
    if (outcome == MASS_REGULAR) {
        return true;
    }
    return report(instance, outcome == MASS_SINGULAR ? FAILURE_SINGULAR : FAILURE_NOT_FINITE, time, concerned);
}

/* qdd[n] at the given time and states. */
static bool accelerations_at(Instance *instance, double time, const double states[], double accelerations[]) {
    const State *state = &instance->state;
    double pivots[N_COORDINATES];
    bool concerned[N_COORDINATES];

    mechanism_accelerations(time, states, state->inputs, state->parameters, accelerations, pivots);
    if (!pivots_sound(instance, pivots)) {
        if (!factorize_densely(instance, time, states, &instance->scratch.factorization)) {
            return false;
        }
        memcpy(accelerations, instance->scratch.forcing, N_COORDINATES * sizeof(double));
        mass_solve(&instance->scratch.factorization, accelerations);
    }
    return all_finite(accelerations, concerned) || report(instance, FAILURE_NOT_FINITE, time, concerned);
}

bool equations_derivative(Instance *instance, double time, const double states[], double derivatives[]) {
    memcpy(derivatives, states + N_COORDINATES, N_COORDINATES * sizeof(double));
    return accelerations_at(instance, time, states, derivatives + N_COORDINATES);
}

void equations_dependent(Instance *instance) {
    if (!instance->cache.dependent_valid) {
        mechanism_dependent(instance->state.parameters, instance->cache.dependent);
        instance->cache.dependent_valid = true;
    }
}

bool equations_accelerations(Instance *instance) {
    Cache *cache = &instance->cache;
    const State *state = &instance->state;
    if (!cache->accelerations_valid) {
        cache->accelerations_valid = accelerations_at(instance, state->time, state->states, cache->accelerations);
    }
    return cache->accelerations_valid;
}

bool equations_locals(Instance *instance) {
    Cache *cache = &instance->cache;
    const State *state = &instance->state;
    if (!cache->locals_valid && equations_accelerations(instance)) {
        mechanism_locals(state->time, state->states, state->inputs, state->parameters, cache->accelerations,
                         cache->locals);
        cache->locals_valid = true;
    }
    return cache->locals_valid;
}

void equations_dependent_tangent(const Instance *instance, const Seed *seed, Tangent *tangent) {
    mechanism_dependent_tangent(instance->state.parameters, seed->parameters, tangent->dependent);
}

/* Brings the factorisation of M at the present point up to date; it serves all seeds. */
static bool update_factor(Instance *instance) {
    Cache *cache = &instance->cache;
    const State *state = &instance->state;
    double pivots[N_COORDINATES];
    if (cache->factor_valid) {
        return true;
    }
    mechanism_factor(state->time, state->states, state->inputs, state->parameters, cache->factor, pivots);
    cache->factor_dense = !pivots_sound(instance, pivots);
    cache->factor_valid = !cache->factor_dense ||
                          factorize_densely(instance, state->time, state->states, &cache->dense);
    return cache->factor_valid;
}

/* With r = M qdd - f = 0 the accelerations change by dqdd = -M^-1 dr, where dr is the derivative of r along the seed
   with qdd held fixed. */
bool equations_tangent(Instance *instance, const Seed *seed, Tangent *tangent) {
    const State *state = &instance->state;
    Cache *cache = &instance->cache;
    double change[N_COORDINATES];
    if (!equations_accelerations(instance) || !update_factor(instance)) {
        return false;
    }
    mechanism_residual_tangent(state->time, state->states, state->inputs, state->parameters, cache->accelerations,
                               seed->time, seed->states, seed->inputs, seed->parameters, change);
    if (cache->factor_dense) {
        memcpy(tangent->accelerations, change, sizeof change);
        mass_solve(&cache->dense, tangent->accelerations);
    } else {
        mechanism_solve(cache->factor, change, tangent->accelerations);
    }
    for (int i = 0; i < N_COORDINATES; i++) {
        tangent->accelerations[i] = -tangent->accelerations[i];
    }
    mechanism_locals_tangent(state->time, state->states, state->inputs, state->parameters, cache->accelerations,
                             seed->time, seed->states, seed->inputs, seed->parameters, tangent->accelerations,
                             tangent->locals);
    return true;
}
