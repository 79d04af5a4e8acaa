/* The steps of equations_tangent backwards, each transposed. */
#include "adjoint.h"

#include <stddef.h>

#include "adjoint_parts.h"
#include "equations.h"
#include "seeds.h"
#include "values.h"

double *adjoint_weight(Tangent *weights, Seed *sensitivity, const Variable *variable) {
    const bool moves = variable->kind != VARIABLE_IMPULSE;
    return moves ? (double *)value_in_tangent(sensitivity, weights, variable) : NULL;
}

static bool any(const double values[], int count) {
    bool found = false;
    for (int i = 0; i < count && !found; i++) {
        found = values[i] != 0.0;
    }
    return found;
}

void dependent_adjoint(const Instance *instance, const Tangent *weights, Seed *sensitivity) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_OF(mark, Seed, term);
    memset(term, 0, sizeof *term);
    mechanism_dependent_adjoint(instance->state.parameters, weights->dependent, term->parameters);
    seed_add(sensitivity, term);
    arena_release(mark);
}

bool motion_adjoint(Instance *instance, const Tangent *weights, Seed *sensitivity) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, unknowns, N_UNKNOWNS);
    WORK_ZEROS(mark, double, change, N_RESIDUALS);
    WORK_OF(mark, Seed, term);
    WORK_OF(mark, Spread, spread);
    const State *state = &instance->state;
    const Cache *cache = &instance->cache;
    memset(term, 0, sizeof *term);
    if (!equations_accelerations(instance) || !equations_factorize(instance)) {
        return arena_leave(mark, false);
    }
    mechanism_unknowns_adjoint(state->time, state->states, state->inputs, state->parameters, cache->reported,
                               weights->further, weights->locals, unknowns);
    for (int i = 0; i < N_UNKNOWNS; i++) {
        unknowns[i] += weights->accelerations[i];
    }
    multipliers_spread_adjoint(instance, unknowns, spread);
    contacts_answer_adjoint(instance, unknowns, sensitivity);
    system_answer_adjoint(&cache->system, unknowns, change);
    multipliers_spread_knowns(instance, spread, change, sensitivity);
    accelerations_stabilise_adjoint(instance, change);
    mechanism_adjoint(state->time, state->states, state->inputs, state->parameters, cache->reported, change,
                      weights->further, &term->time, term->states, term->inputs, term->parameters);
    seed_add(sensitivity, term);
    if (any(weights->locals, N_LOCALS)) {
        memset(term, 0, sizeof *term);
        mechanism_locals_adjoint(state->time, state->states, state->inputs, state->parameters, cache->reported,
                                 weights->locals, &term->time, term->states, term->inputs, term->parameters);
        seed_add(sensitivity, term);
    }
    return arena_leave(mark, true);
}

/* equations_settle_seed */
static bool settle_adjoint(Instance *instance, Seed *sensitivity) {
    const bool solving = instance->state.phase == PHASE_SOLVING_START;
    if (N_CONSTRAINTS == 0 || (N_MASSLESS == 0 && !solving)) {
        return true;
    }
    if (!equations_accelerations(instance)) {
        return false;
    }
    if (!solving) {
        return massless_settle_adjoint(instance, sensitivity);
    }
    constraints_settle_adjoint(instance, sensitivity);
    return true;
}

bool equations_adjoint(Instance *instance, const Tangent *weights, Seed *sensitivity) {
    if (!equations_settle(instance)) {
        return false;
    }
    dependent_adjoint(instance, weights, sensitivity);
    if ((any(weights->accelerations, N_UNKNOWNS) || any(weights->further, N_FURTHER) ||
         any(weights->locals, N_LOCALS)) &&
        !motion_adjoint(instance, weights, sensitivity)) {
        return false;
    }
    return settle_adjoint(instance, sensitivity);
}
