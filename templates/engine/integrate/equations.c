/* Evaluating the generated functions of mechanism.h, at the present point and at the stages of the solver. */
#include "equations.h"

#include <string.h>

#include "accelerations.h"
#include "constraints.h"
#include "contact_events.h"
#include "contacts.h"
#include "events.h"
#include "further.h"
#include "massless.h"
#include "system.h"
#include "tables.h"

/* Bound of the solutions for the start, each under the sides of kinks that the one before has come to. */
enum { MOST_START_ROUNDS = 20 };

/* Constraints with kinks are solved under the sides that the given start is on; where the solution is on other ones,
   once more from there. */
bool equations_settle(Instance *instance) {
    State *state = &instance->state;
    if (N_CONSTRAINTS == 0 || state->phase != PHASE_SOLVING_START || state->settled) {
        return true;
    }
    events_take_sides(instance);
    for (int round = 0; round < MOST_START_ROUNDS; round++) {
        if (!constraints_settle(instance)) {
            return false;
        }
        if (!events_take_sides(instance)) {
            break;
        }
        state->settled = 0;
    }
    return true;
}

void equations_dependent(Instance *instance) {
    if (!instance->cache.dependent_valid) {
        mechanism_dependent(instance->state.parameters, instance->cache.dependent);
        instance->cache.dependent_valid = true;
    }
}

bool equations_massless(Instance *instance) {
    return instance->policy->project || instance->state.phase != PHASE_RUNNING || massless_settle(instance);
}

bool equations_factorize(Instance *instance) {
    Cache *cache = &instance->cache;
    const State *state = &instance->state;
    if (!cache->system_valid) {
        cache->system_valid = system_factorize(instance, state->time, state->states, state->inputs, N_CONSTRAINTS, 0.0,
                                               &cache->system);
    }
    return cache->system_valid;
}

/* Do the modes follow an assignment at once? Where the importer integrates, they wait for an event. In time stepping
   they wait for a step. If a communication step has ended at an event, they wait for integrator_settle. */
static bool modes_follow(const Instance *instance) {
    const bool located = instance->policy->integrate && !TIME_STEPPING;
    return N_EVENTS > 0 && !instance->state.event_held && (located || instance->state.phase != PHASE_RUNNING);
}

bool equations_accelerations(Instance *instance) {
    Cache *cache = &instance->cache;
    const State *state = &instance->state;
    bool jumped = false;
    if (!equations_massless(instance) || (modes_follow(instance) && !events_refresh(instance, &jumped))) {
        return false;
    }
    if (!cache->accelerations_valid) {
        const bool unique = multipliers_unique(instance);
        cache->accelerations_valid =
            accelerations_at(instance, state->time, state->states, state->inputs, cache->accelerations) &&
            (unique || equations_factorize(instance));
        memcpy(cache->reported, cache->accelerations, sizeof cache->reported);
        if (cache->accelerations_valid && !unique) {
            multipliers_spread(&cache->system, cache->reported);
        }
        cache->accelerations_valid =
            cache->accelerations_valid && further_rates(instance, state->time, state->states, state->inputs,
                                                        cache->reported, cache->further);
        if (!cache->accelerations_valid) {
            tables_explain(instance, state->time, state->states, state->inputs);
        }
    }
    return cache->accelerations_valid;
}

void equations_remember(Instance *instance) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_OF(mark, Motion, motion);
    if (N_CONSTRAINTS > 0 && instance->policy->remember && equations_motion(instance, MAX_OUTPUT_ORDER, motion)) {
        constraints_remember(instance, motion);
    }
    arena_release(mark);
}

bool equations_multipliers(Instance *instance) {
    Cache *cache = &instance->cache;
    const bool known = equations_accelerations(instance);
    if (known && !cache->shown_valid) {
        memcpy(cache->shown, cache->reported, sizeof cache->shown);
        contacts_share(instance, &cache->system, cache->shown);
        cache->shown_valid = true;
    }
    return known;
}

bool equations_locals(Instance *instance) {
    Cache *cache = &instance->cache;
    const State *state = &instance->state;
    if (!cache->locals_valid && equations_multipliers(instance)) {
        mechanism_locals(state->time, state->states, state->inputs, state->parameters, cache->shown, cache->locals);
        cache->locals_valid = true;
    }
    return cache->locals_valid;
}

bool equations_indicators(Instance *instance) {
    Cache *cache = &instance->cache;
    bool jumped;
    if (!equations_massless(instance) || (modes_follow(instance) && !events_refresh(instance, &jumped))) {
        return false;
    }
    cache->indicators_valid = cache->indicators_valid || events_indicate(instance, cache->indicators);
    return cache->indicators_valid;
}

bool equations_settle_seed(Instance *instance, Seed *seed) {
    const bool solving = instance->state.phase == PHASE_SOLVING_START;
    if (N_CONSTRAINTS == 0 || (N_MASSLESS == 0 && !solving)) {
        return true;
    }
    if (!equations_accelerations(instance)) {
        return false;
    }
    if (!solving) {
        return massless_settle_seed(instance, seed);
    }
    constraints_settle_seed(instance, seed);
    return true;
}

void equations_dependent_tangent(const Instance *instance, const Seed *seed, Tangent *tangent) {
    mechanism_dependent_tangent(instance->state.parameters, seed->parameters, tangent->dependent);
}

/* With r = M qdd - f = 0 the accelerations change by dqdd = -M^-1 dr, where dr is the derivative of r along the seed
   with qdd held fixed. With constraints the same holds for all unknowns and the matrix of their system. */
bool equations_tangent(Instance *instance, const Seed *seed, Tangent *tangent) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, change, N_RESIDUALS);
    const State *state = &instance->state;
    Cache *cache = &instance->cache;
    if (!equations_accelerations(instance) || !equations_factorize(instance)) {
        return arena_leave(mark, false);
    }
    mechanism_residual_tangent(state->time, state->states, state->inputs, state->parameters, cache->accelerations,
                               seed->time, seed->states, seed->inputs, seed->parameters, change);
    accelerations_stabilise(instance, change);
    system_answer(&cache->system, change, tangent->accelerations);
    contacts_answer(instance, &cache->system, state->time, state->states, state->inputs, cache->accelerations, seed,
                    tangent->accelerations);
    multipliers_spread_rates(instance, seed, tangent->accelerations);
    further_tangent(instance, state->time, state->states, state->inputs, cache->reported, seed, tangent->accelerations,
                    tangent->further);
    return arena_leave(mark, true);
}

void equations_locals_tangent(const Instance *instance, const Seed *seed, Tangent *tangent) {
    const State *state = &instance->state;
    mechanism_locals_tangent(state->time, state->states, state->inputs, state->parameters, instance->cache.reported,
                             seed->time, seed->states, seed->inputs, seed->parameters, tangent->accelerations,
                             tangent->locals);
}

/* The seed along the motion, whose accelerations are known. */
static void motion_seed(const Instance *instance, const Motion *motion, Seed *seed) {
    memset(seed, 0, sizeof *seed);
    seed->time = 1.0;
    memcpy(seed->states, motion->q[1], N_COORDINATES * sizeof(double));
    memcpy(seed->states + N_COORDINATES, motion->q[2], N_COORDINATES * sizeof(double));
    memcpy(seed->states + 2 * N_COORDINATES, motion->further[0], N_FURTHER * sizeof(double));
    memcpy(seed->inputs, instance->state.inputs + N_INPUTS, sizeof seed->inputs);
}

/* Differentiating r = 0 twice along the motion gives d4q = -M^-1 d2r, where d2r is the second derivative at d4q = 0 and
   with constant forces of sliding. */
bool equations_motion(Instance *instance, int order, Motion *motion) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, change, N_UNKNOWNS);
    WORK_OF(mark, Tangent, tangent);
    WORK_OF(mark, Seed, seed);
    const State *state = &instance->state;
    const Cache *cache = &instance->cache;
    const double *du = state->inputs + N_INPUTS, *d2u = du + N_INPUTS; /* each with its rates behind it */
    memcpy(motion->q[0], state->states, N_COORDINATES * sizeof(double));
    memcpy(motion->q[1], state->states + N_COORDINATES, N_COORDINATES * sizeof(double));
    if (order >= 0) {
        if (!equations_accelerations(instance)) {
            return arena_leave(mark, false);
        }
        memcpy(motion->q[2], cache->accelerations, sizeof cache->accelerations);
        memcpy(motion->further[0], cache->further, sizeof cache->further);
    }
    if (order >= 1) {
        motion_seed(instance, motion, seed);
        if (!equations_tangent(instance, seed, tangent)) {
            return arena_leave(mark, false);
        }
        memcpy(motion->q[3], tangent->accelerations, sizeof tangent->accelerations);
        memcpy(motion->further[1], tangent->further, sizeof tangent->further);
    }
    if (order >= 2) {
        mechanism_residual_second(state->time, state->states, state->inputs, state->parameters, cache->reported,
                                  du, d2u, motion->q[3], change);
        system_answer(&cache->system, change, motion->q[4]);
        contacts_answer_twice(instance, &cache->system, du, d2u, motion->q[3], motion->q[4]);
    }
    return arena_leave(mark, true);
}

void equations_locals_motion(Instance *instance, int order, Motion *motion) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_OF(mark, Tangent, tangent);
    WORK_OF(mark, Seed, seed);
    const State *state = &instance->state;
    const double *du = state->inputs + N_INPUTS, *d2u = du + N_INPUTS;
    if (order >= 1) {
        motion_seed(instance, motion, seed);
        memcpy(tangent->accelerations, motion->q[3], sizeof tangent->accelerations);
        equations_locals_tangent(instance, seed, tangent);
        memcpy(motion->locals[0], tangent->locals, sizeof tangent->locals);
    }
    if (order >= 2) {
        mechanism_locals_second(state->time, state->states, state->inputs, state->parameters, instance->cache.reported,
                                du, d2u, motion->q[3], motion->q[4], motion->locals[1]);
    }
    arena_release(mark);
}
