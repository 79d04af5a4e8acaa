#include "rubbing.h"

#include <string.h>

#include "sliding_rows.h"

void rubbing_alone(const Instance *instance, const double unknowns[], double alone[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, int, sliding, SIZE_FRICTIONAL);
    const int count = sliding_find(&instance->state, sliding);
    memset(alone, 0, N_UNKNOWNS * sizeof(double));
    for (int k = 0; k < count; k++) {
        alone[N + ROW_PLACES[sliding[k]]] = unknowns[N + ROW_PLACES[sliding[k]]];
    }
    arena_release(mark);
}

void rubbing_tangent(const Instance *instance, double time, const double states[], const double inputs[],
                     const double unknowns[], const Seed *seed, const double answer[], double change[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, alone, N_UNKNOWNS);
    WORK(mark, double, with, N_RESIDUALS);
    WORK(mark, double, without, N_RESIDUALS);
    WORK_ZEROS(mark, double, still, N_UNKNOWNS);
    const double *parameters = instance->state.parameters;
    rubbing_alone(instance, unknowns, alone);
    mechanism_residual_tangent(time, states, inputs, parameters, alone, seed->time, seed->states, seed->inputs,
                               seed->parameters, with);
    mechanism_residual_tangent(time, states, inputs, parameters, still, seed->time, seed->states, seed->inputs,
                               seed->parameters, without);
    for (int i = 0; i < N; i++) {
        change[i] += without[i] - with[i];
    }
    sliding_push(instance, time, states, inputs, answer, change);
    arena_release(mark);
}
