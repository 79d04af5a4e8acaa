/* Forces of sliding, for methods that work on forces. */
#include "accelerations.h"
#include "contacts.h"
#include "inputs.h"
#include "sliding_rows.h"

void sliding_push(const Instance *instance, double time, const double states[], const double inputs[],
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
    sliding_push(instance, time, states, inputs, unknowns, forces);
    return arena_leave(mark, true);
}
