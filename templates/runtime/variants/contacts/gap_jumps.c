/* Gaps that jump where a switch turns: a table ends there, or a step begins. */
#include <math.h>

#include "contact_modes.h"
#include "contacts.h"
#include "inputs.h"

/* A gap jumps if it changes by more than this part of nominal values: more than a kink changes it within the error of
   the event's location. The error of an importer's location may be greater. */
static const double JUMPS = 1e-6, JUMPS_LOOSELY = 1e-2;

static void measure(Instance *instance, ElementRows *rows) {
    const State *state = &instance->state;
    rows_evaluate(instance, state->time, state->states, inputs_at(instance, state->time), rows);
}

void contacts_gaps(Instance *instance, double gaps[]) {
    ElementRows rows;
    measure(instance, &rows);
    for (int i = 0; i < N_UNILATERALS; i++) {
        gaps[i] = rows.positions[i];
    }
}

bool contacts_jump(Instance *instance, const double before[]) {
    const double most = instance->policy->stabilise ? JUMPS_LOOSELY : JUMPS;
    ElementRows rows;
    measure(instance, &rows);
    for (int i = 0; i < N_UNILATERALS; i++) {
        const double gap = rows.positions[i], change = gap - before[i], size = row_size(&rows, i);
        if (contact_closed(&instance->state, i) && change > JUMPS * size) {
            contact_open(&instance->state, i);
        } else if (change < -most * size && gap < -most * size) {
            instance->failure.kind = FAILURE_JUMP;
            instance->failure.time = instance->state.time;
            instance->failure.count = ROW_PLACES[i];
            instance->failure.amount = gap;
            return false;
        }
    }
    return true;
}
