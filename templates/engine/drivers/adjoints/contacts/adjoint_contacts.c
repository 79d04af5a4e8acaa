/* contacts_answer backwards: z = s along the seed and the answer, which the forces z change. */
#include "adjoint_parts.h"
#include "lu.h"
#include "seeds.h"
#include "sliding_rows.h"

/* rows[count] for weights[count] of the forces; false if there is no definite answer. */
static bool solve_transposed(const Instance *instance, const Sliding *sliding, const double weights[], double rows[]) {
    const State *state = &instance->state;
    double slope[SIZE_FRICTIONAL * SIZE_FRICTIONAL], transposed[SIZE_FRICTIONAL * SIZE_FRICTIONAL];
    int order[SIZE_FRICTIONAL];
    const int count = sliding->count;
    sliding_slope(instance, state->time, state->states, state->inputs, instance->cache.accelerations, sliding, slope);
    for (int i = 0; i < count; i++) {
        for (int k = 0; k < count; k++) {
            transposed[k * count + i] = slope[i * count + k];
        }
    }
    if (!lu_factorize(transposed, order, count)) {
        return false;
    }
    lu_solve(transposed, order, count, weights, rows);
    return true;
}

void contacts_answer_adjoint(Instance *instance, double unknowns[], Seed *sensitivity) {
    const State *state = &instance->state;
    double weights[SIZE_FRICTIONAL] = {0.0}, rows[SIZE_FRICTIONAL], of_forces[SIZE_FRICTIONAL] = {0.0};
    double of_unknowns[N_UNKNOWNS];
    Seed term = {0};
    Sliding sliding;
    sliding_evaluate(instance, &instance->cache.system, state->time, state->states, state->inputs, &sliding);
    for (int k = 0; k < sliding.count; k++) {
        for (int i = 0; i < N_UNKNOWNS; i++) {
            weights[k] += sliding.answer[k][i] * unknowns[i];
        }
    }
    if (sliding.count == 0 || !solve_transposed(instance, &sliding, weights, rows)) {
        return;
    }
    for (int k = 0; k < sliding.count; k++) {
        of_forces[sliding.row[k] - FIRST_SLIP] = rows[k];
    }
    mechanism_friction_adjoint(state->time, state->states, state->inputs, state->parameters,
                               instance->cache.accelerations, of_forces, &term.time, term.states, term.inputs,
                               term.parameters, of_unknowns);
    seed_add(sensitivity, &term);
    for (int i = 0; i < N_UNKNOWNS; i++) {
        unknowns[i] += of_unknowns[i];
    }
}
