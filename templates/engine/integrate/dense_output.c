#include "dense_output.h"

#include <string.h>

void dense_begin_cubic(Instance *instance, Step step) {
    State *state = &instance->state;
    const Scratch *scratch = &instance->scratch;
    Dense *dense = &state->dense;
    dense->start = state->time;
    dense->rate = 1.0 / step.length;
    dense->end = step.end;
    memcpy(dense->end_states, scratch->new_states, sizeof dense->end_states);
    memcpy(dense->states, state->states, sizeof dense->states);
    for (int i = 0; i < N_STATES; i++) {
        dense->terms[0][i] = scratch->new_states[i] - state->states[i];
        dense->terms[1][i] = step.length * state->first_stage[i] - dense->terms[0][i];
        dense->terms[2][i] = dense->terms[0][i] - step.length * scratch->new_derivatives[i] - dense->terms[1][i];
    }
    if (METHOD.order == 2 && N_EVENTS > 0) {
        memset(dense->terms[2], 0, N_COORDINATES * sizeof dense->terms[2][0]);
    }
    memset(dense->terms + HERMITE_TERMS, 0, DENSE_ROWS * sizeof dense->terms[0]);
}

bool dense_begin(Instance *instance, Step step) {
    dense_begin_cubic(instance, step);
    return solver_dense(instance, step, instance->state.dense.terms);
}

void dense_states(const Dense *dense, double time, double states[]) {
    const double theta = (time - dense->start) * dense->rate;
    const double factors[2] = {theta, 1.0 - theta};
    for (int i = 0; i < N_STATES; i++) {
        double value = dense->terms[DENSE_TERMS - 1][i];
        for (int k = DENSE_TERMS - 2; k >= 0; k--) {
            value = dense->terms[k][i] + factors[(k + 1) % 2] * value;
        }
        states[i] = dense->states[i] + theta * value;
    }
}
