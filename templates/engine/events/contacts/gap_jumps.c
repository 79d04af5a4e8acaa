/* Gaps that jump where a switch turns: a table ends there, or a step begins. */

#include "contact_events.h"
#include "contact_modes.h"
#include "failure.h"
#include "inputs.h"
#include "scale.h"

static void measure(Instance *instance, ElementRows *rows) {
    const State *state = &instance->state;
    rows_evaluate(instance, state->time, state->states, inputs_at(instance, state->time), rows);
}

void contacts_gaps(Instance *instance, double gaps[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_OF(mark, ElementRows, rows);
    measure(instance, rows);
    for (int i = 0; i < N_UNILATERALS; i++) {
        gaps[i] = rows->positions[i];
    }
    arena_release(mark);
}

bool contacts_jump(Instance *instance, const double before[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_OF(mark, ElementRows, rows);
    const double most = instance->policy->integrate ? LOCATED : LOCATED_LOOSELY;
    measure(instance, rows);
    for (int i = 0; i < N_UNILATERALS; i++) {
        const double gap = rows->positions[i], change = gap - before[i], size = row_size(rows, i);
        if (contact_closed(&instance->state, i) && change > LOCATED * size) {
            instance->state.event_rests[N_SWITCHES + 2 * i] = 0.0; /* it was of the force, not of the gap */
            contact_open(&instance->state, i);
        } else if (change < -most * size && gap < -most * size) {
            return arena_leave(
                mark, report_constraint(instance, FAILURE_JUMP, instance->state.time, ROW_PLACES[i], gap));
        }
    }
    return arena_leave(mark, true);
}
