/* rubbing_tangent backwards. */
#include "reverse_rubbing.h"

#include <string.h>

#include "rubbing.h"
#include "seeds.h"
#include "sliding_rows.h"

/* Adds, with a factor, what weights[n] of the residual at the unknowns give. */
static void add_residual(const Instance *instance, const double unknowns[], const double weights[], double factor,
                         Seed *sensitivity) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_ZEROS(mark, double, change, N_RESIDUALS);
    WORK_ZEROS(mark, double, of_further, SIZE_FURTHER);
    WORK_OF(mark, Seed, term);
    const State *state = &instance->state;
    memset(term, 0, sizeof *term);
    for (int i = 0; i < N; i++) {
        change[i] = factor * weights[i];
    }
    mechanism_adjoint(state->time, state->states, state->inputs, state->parameters, unknowns, change, of_further,
                      &term->time, term->states, term->inputs, term->parameters);
    seed_add(sensitivity, term);
    arena_release(mark);
}

void reverse_rubbing(const Instance *instance, const double weights[], double unknowns[], Seed *sensitivity) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, int, sliding, SIZE_FRICTIONAL);
    WORK(mark, double, alone, N_UNKNOWNS);
    WORK_ZEROS(mark, double, still, N_UNKNOWNS);
    WORK_OF(mark, ElementRows, rows);
    const State *state = &instance->state;
    const int count = sliding_find(state, sliding);
    rubbing_alone(instance, instance->cache.accelerations, alone);
    add_residual(instance, alone, weights, -1.0, sensitivity);
    add_residual(instance, still, weights, 1.0, sensitivity);
    rows_evaluate(instance, state->time, state->states, state->inputs, rows);
    for (int k = 0; k < count; k++) {
        for (int i = 0; i < N; i++) {
            unknowns[N + ROW_PLACES[sliding[k]]] += weights[i] * rows->jacobian[sliding[k] * N + i];
        }
    }
    arena_release(mark);
}
