/* Evaluating the generated functions of mechanism.h, at the present point and at the stages of the solver. */
#include "equations.h"

#include <string.h>

#include "accelerations.h"
#include "finite.h"
#include "inputs.h"
#include "system.h"
#if N_CONSTRAINTS > 0
#include "constraint_projection.h"
#endif
#if N_MASSLESS > 0
#include "massless.h"
#endif

bool equations_derivative(Instance *instance, double time, const double states[], double derivatives[]) {
    double *accelerations = derivatives + N_COORDINATES;
    memcpy(derivatives, states + N_COORDINATES, N_COORDINATES * sizeof(double));
#if N_CONSTRAINTS > 0
    double unknowns[N_UNKNOWNS];
    const bool known = accelerations_at(instance, time, states, inputs_at(instance, time), unknowns);
    memcpy(accelerations, unknowns, N_COORDINATES * sizeof(double));
    return known;
#else
    return accelerations_at(instance, time, states, inputs_at(instance, time), accelerations);
#endif
}

/* unknowns = - K^-1 change, with a factorisation of the matrix K of the system. */
static void solve_for_change(const System *system, double change[], double unknowns[]) {
    for (int i = 0; i < N_UNKNOWNS; i++) {
        change[i] = -change[i];
    }
    system_solve(system, change, change + N_COORDINATES, NULL, unknowns);
}

#if IMPLICIT

/* Columns whose rows do not meet are one colour and share a seed: COLOURS[colour][i] is the one that has an entry in
   row i, -1 if none has. Curtis, Powell, Reid, On the estimation of sparse Jacobian matrices, IMA Journal of Applied
   Mathematics 13, 1974. */
bool equations_jacobian(Instance *instance, double time, const double states[], double jacobian[]) {
    static const double NO_INPUTS[N_INPUTS], NO_PARAMETERS[SIZE_PARAMETERS];
    const double *inputs = inputs_at(instance, time), *parameters = instance->state.parameters;
    System *system = &instance->scratch.system;
    double unknowns[N_UNKNOWNS], changed[N_UNKNOWNS], change[N_RESIDUALS];
    if (!accelerations_at(instance, time, states, inputs, unknowns) ||
        !system_factorize(instance, time, states, inputs, N_CONSTRAINTS, 0.0, system)) {
        return false;
    }
    memset(jacobian, 0, SIZE_JACOBIAN * sizeof(double));
    for (int colour = 0; colour < N_COLOURS; colour++) {
        const int *column = COLOURS[colour];
        double seed[N_STATES] = {0.0};
        for (int i = 0; i < N_COORDINATES; i++) {
            if (column[i] >= 0) {
                seed[column[i]] = 1.0;
            }
        }
        mechanism_residual_tangent(time, states, inputs, parameters, unknowns, 0.0, seed, NO_INPUTS, NO_PARAMETERS,
                                   change);
        solve_for_change(system, change, changed);
        for (int i = 0; i < N_COORDINATES; i++) {
            if (column[i] >= 0) {
                jacobian[column[i] * N_COORDINATES + i] = changed[i];
            }
        }
    }
    return true;
}

#endif

bool equations_settle(Instance *instance) {
#if N_CONSTRAINTS > 0
    if (instance->state.mode == MODE_INITIALIZATION) {
        return constraints_settle(instance);
    }
#else
    (void)instance;
#endif
    return true;
}

void equations_dependent(Instance *instance) {
    if (!instance->cache.dependent_valid) {
        mechanism_dependent(instance->state.parameters, instance->cache.dependent);
        instance->cache.dependent_valid = true;
    }
}

bool equations_massless(Instance *instance) {
#if N_MASSLESS > 0
    const bool started = instance->state.mode != MODE_INSTANTIATED && instance->state.mode != MODE_INITIALIZATION;
    return instance->type == fmi2CoSimulation || !started || massless_settle(instance);
#else
    (void)instance;
    return true;
#endif
}

/* Brings the factorisation at the present point up to date; it serves all seeds. */
static bool update_system(Instance *instance) {
    Cache *cache = &instance->cache;
    const State *state = &instance->state;
    if (!cache->system_valid) {
        cache->system_valid = system_factorize(instance, state->time, state->states, state->inputs, N_CONSTRAINTS, 0.0,
                                               &cache->system);
    }
    return cache->system_valid;
}

bool equations_accelerations(Instance *instance) {
    Cache *cache = &instance->cache;
    const State *state = &instance->state;
    if (!equations_massless(instance)) {
        return false;
    }
    if (!cache->accelerations_valid) {
        const bool unique = multipliers_unique(instance);
        cache->accelerations_valid =
            accelerations_at(instance, state->time, state->states, state->inputs, cache->accelerations) &&
            (unique || update_system(instance));
        memcpy(cache->reported, cache->accelerations, sizeof cache->reported);
        if (cache->accelerations_valid && !unique) {
            multipliers_spread(&cache->system, cache->reported);
        }
    }
    return cache->accelerations_valid;
}

#if N_CONSTRAINTS > 0
void equations_remember(Instance *instance) {
    State *state = &instance->state;
    Motion motion;
    if (!equations_motion(instance, MAX_OUTPUT_ORDER, &motion) || instance->cache.system.constraints.holding) {
        return; /* there they would be those remembered so far */
    }
    for (int order = 0; order <= MAX_OUTPUT_ORDER; order++) {
        memcpy(state->usual[order], motion.q[2 + order], sizeof state->usual[order]);
        if (!all_finite(state->usual[order], N_COORDINATES)) {
            state->usual_known = 0;
            return;
        }
    }
    state->usual_known = 1;
    state->usual_time = state->time;
    instance_forget_motion(instance); /* what is calculated again has to be the same after going back to this State */
}
#endif

bool equations_locals(Instance *instance) {
    Cache *cache = &instance->cache;
    const State *state = &instance->state;
    if (!cache->locals_valid && equations_accelerations(instance)) {
        mechanism_locals(state->time, state->states, state->inputs, state->parameters, cache->reported,
                         cache->locals);
        cache->locals_valid = true;
    }
    return cache->locals_valid;
}

bool equations_settle_seed(Instance *instance, Seed *seed) {
#if N_CONSTRAINTS > 0
    if (instance->state.mode == MODE_INITIALIZATION) {
        return constraints_settle_seed(instance, seed);
    }
#endif
#if N_MASSLESS > 0
    return massless_settle_seed(instance, seed);
#else
    (void)instance;
    (void)seed;
#endif
    return true;
}

void equations_dependent_tangent(const Instance *instance, const Seed *seed, Tangent *tangent) {
    mechanism_dependent_tangent(instance->state.parameters, seed->parameters, tangent->dependent);
}

/* With r = M qdd - f = 0 the accelerations change by dqdd = -M^-1 dr, where dr is the derivative of r along the seed
   with qdd held fixed; with constraints likewise for all unknowns. */
bool equations_tangent(Instance *instance, const Seed *seed, Tangent *tangent) {
    const State *state = &instance->state;
    Cache *cache = &instance->cache;
    double change[N_RESIDUALS];
    if (!equations_accelerations(instance) || !update_system(instance)) {
        return false;
    }
    mechanism_residual_tangent(state->time, state->states, state->inputs, state->parameters, cache->accelerations,
                               seed->time, seed->states, seed->inputs, seed->parameters, change);
#if N_CONSTRAINTS > 0
    const double rate = stabilisation(instance);
    for (int k = 0; k < N_CONSTRAINTS; k++) {
        change[N_COORDINATES + k] += 2.0 * rate * change[N_UNKNOWNS + k];
    }
    for (int k = 0; k < N_HOLONOMIC; k++) {
        change[N_COORDINATES + k] += rate * rate * change[N_UNKNOWNS + N_CONSTRAINTS + k];
    }
#endif
    solve_for_change(&cache->system, change, tangent->accelerations);
    multipliers_spread(&cache->system, tangent->accelerations);
    mechanism_locals_tangent(state->time, state->states, state->inputs, state->parameters, cache->reported,
                             seed->time, seed->states, seed->inputs, seed->parameters, tangent->accelerations,
                             tangent->locals);
    return true;
}

/* Differentiating r = 0 twice along the motion gives d4q = -M^-1 d2r, where d2r is the second derivative at d4q = 0. */
bool equations_motion(Instance *instance, int order, Motion *motion) {
    const State *state = &instance->state;
    const Cache *cache = &instance->cache;
    const double *du = state->inputs + N_INPUTS, *d2u = du + N_INPUTS; /* each with its rates behind it */
    double change[N_UNKNOWNS];
    memcpy(motion->q[0], state->states, N_COORDINATES * sizeof(double));
    memcpy(motion->q[1], state->states + N_COORDINATES, N_COORDINATES * sizeof(double));
    if (order >= 0) {
        if (!equations_accelerations(instance)) {
            return false;
        }
        memcpy(motion->q[2], cache->accelerations, sizeof cache->accelerations);
    }
    if (order >= 1) {
        Seed seed = {.time = 1.0};
        Tangent tangent;
        memcpy(seed.states, motion->q[1], N_COORDINATES * sizeof(double));
        memcpy(seed.states + N_COORDINATES, motion->q[2], N_COORDINATES * sizeof(double));
        memcpy(seed.inputs, du, sizeof seed.inputs);
        if (!equations_tangent(instance, &seed, &tangent)) {
            return false;
        }
        memcpy(motion->q[3], tangent.accelerations, sizeof tangent.accelerations);
        memcpy(motion->locals[0], tangent.locals, sizeof tangent.locals);
    }
    if (order >= 2) {
        mechanism_residual_second(state->time, state->states, state->inputs, state->parameters, cache->accelerations,
                                  du, d2u, motion->q[3], change);
        solve_for_change(&cache->system, change, motion->q[4]);
        mechanism_locals_second(state->time, state->states, state->inputs, state->parameters, cache->reported,
                                du, d2u, motion->q[3], motion->q[4], motion->locals[1]);
    }
    return true;
}
