/* Evaluating the generated functions of mechanism.h, at the present point and at the stages of the solver. */
#include "equations.h"

#include <math.h>
#include <string.h>

/* qdd[n] at the given time and states, and the factorization it took. */
static bool accelerations_at(Instance *instance, double time, const double states[], Factorization *factorization,
                             double accelerations[]) {
    const State *state = &instance->state;
    Failure *failure = &instance->failure;
    double *mass = instance->scratch.mass;
    bool concerned[N_COORDINATES] = {false};
    bool finite = true;

    mechanism_dynamics(time, states, state->inputs, state->parameters, mass, accelerations);
    const MassOutcome outcome = mass_factorize(mass, factorization, concerned);
    if (outcome == MASS_REGULAR) {
        mass_solve(factorization, accelerations);
        for (int i = 0; i < N_COORDINATES; i++) {
            concerned[i] = !isfinite(accelerations[i]);
            finite = finite && !concerned[i];
        }
        if (finite) {
            return true;
        }
    }
    failure->kind = outcome == MASS_SINGULAR ? FAILURE_SINGULAR : FAILURE_NOT_FINITE;
    failure->time = time;
    memcpy(failure->coordinates, concerned, sizeof concerned);
    return false;
}

bool equations_derivative(Instance *instance, double time, const double states[], double derivatives[]) {
    memcpy(derivatives, states + N_COORDINATES, N_COORDINATES * sizeof(double));
    return accelerations_at(instance, time, states, &instance->scratch.factorization, derivatives + N_COORDINATES);
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
        cache->accelerations_valid =
            accelerations_at(instance, state->time, state->states, &cache->mass, cache->accelerations);
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

/* With r = M qdd - f = 0 the accelerations change by dqdd = -M^-1 dr, where dr is the derivative of r along the seed
   with qdd held fixed; M is factorised already. */
bool equations_tangent(Instance *instance, const Seed *seed, Tangent *tangent) {
    const State *state = &instance->state;
    const Cache *cache = &instance->cache;
    if (!equations_accelerations(instance)) {
        return false;
    }
    mechanism_residual_tangent(state->time, state->states, state->inputs, state->parameters, cache->accelerations,
                               seed->time, seed->states, seed->inputs, seed->parameters, tangent->accelerations);
    mass_solve(&cache->mass, tangent->accelerations);
    for (int i = 0; i < N_COORDINATES; i++) {
        tangent->accelerations[i] = -tangent->accelerations[i];
    }
    mechanism_locals_tangent(state->time, state->states, state->inputs, state->parameters, cache->accelerations,
                             seed->time, seed->states, seed->inputs, seed->parameters, tangent->accelerations,
                             tangent->locals);
    return true;
}
