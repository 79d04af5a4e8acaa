/* Forces of sliding J^T z, for methods that work on forces, and their derivatives J^T dz + dJ^T z. The second term is
   what a z of its own makes of the residual of the equations, M qdd - forcing - J^T z - G^T multiplier. */
#include <string.h>

#include "accelerations.h"
#include "contacts.h"
#include "inputs.h"
#include "sliding_rows.h"

/* Adds J^T z to forces[n], where z is in unknowns[n + m]. */
static void add_sliding(const Instance *instance, double time, const double states[], const double inputs[],
                        const double unknowns[], double forces[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, int, sliding, SIZE_FRICTIONAL);
    WORK_OF(mark, ElementRows, rows);
    rows_evaluate(instance, time, states, inputs, rows);
    const int count = sliding_find(&instance->state, sliding);
    for (int k = 0; k < count; k++) {
        const double *jacobian = rows->jacobian + sliding[k] * N;
        for (int i = 0; i < N; i++) {
            forces[i] += jacobian[i] * unknowns[N + ROW_PLACES[sliding[k]]];
        }
    }
    arena_release(mark);
}

bool contacts_rub(Instance *instance, double time, const double states[], double forces[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, unknowns, N_UNKNOWNS);
    const double *inputs = inputs_at(instance, time);
    if (!accelerations_at(instance, time, states, inputs, unknowns)) {
        return arena_leave(mark, false);
    }
    add_sliding(instance, time, states, inputs, unknowns, forces);
    return arena_leave(mark, true);
}

void sliding_alone(const Instance *instance, const double unknowns[], double alone[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, int, sliding, SIZE_FRICTIONAL);
    const int count = sliding_find(&instance->state, sliding);
    memset(alone, 0, N_UNKNOWNS * sizeof(double));
    for (int k = 0; k < count; k++) {
        alone[N + ROW_PLACES[sliding[k]]] = unknowns[N + ROW_PLACES[sliding[k]]];
    }
    arena_release(mark);
}

void contacts_rub_tangent(const Instance *instance, double time, const double states[], const double inputs[],
                          const double unknowns[], const Seed *seed, const double answer[], double change[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, alone, N_UNKNOWNS);
    WORK(mark, double, with, N_RESIDUALS);
    WORK(mark, double, without, N_RESIDUALS);
    WORK_ZEROS(mark, double, still, N_UNKNOWNS);
    const double *parameters = instance->state.parameters;
    sliding_alone(instance, unknowns, alone);
    mechanism_residual_tangent(time, states, inputs, parameters, alone, seed->time, seed->states, seed->inputs,
                               seed->parameters, with);
    mechanism_residual_tangent(time, states, inputs, parameters, still, seed->time, seed->states, seed->inputs,
                               seed->parameters, without);
    for (int i = 0; i < N; i++) {
        change[i] += without[i] - with[i];
    }
    add_sliding(instance, time, states, inputs, answer, change);
    arena_release(mark);
}
