#include "step_modes.h"

#include <math.h>

#include "contact_modes.h"
#include "contacts.h"
#include "inputs.h"
#include "scale.h"
#include "step_impulses.h"
#include "vector_length.h"

static void settle_contact(Instance *instance, int contact) {
    const SolverScratch *scratch = &instance->scratch.solver;
    State *state = &instance->state;
    const int row = CONTACT_ROWS[contact], end = CONTACT_ROWS[contact + 1];
    bool rests = true;
    if (scratch->impulses[row] > 0.0 && step_collides(instance, contact)) {
        state->impacts[contact]++;
        state->impulses[contact] = scratch->impulses[row];
    }
    const bool apart = !scratch->closing && scratch->end.positions[row] > LOCATED * scratch->end.sizes[row];
    if (!(scratch->impulses[row] > 0.0) || !step_stops(scratch, row) || apart) {
        contact_open(state, contact);
        return;
    }
    for (int k = row + 1; k < end; k++) {
        rests = rests && step_stops(scratch, k);
    }
    if (rests) {
        contact_stick(state, contact);
    } else {
        contact_slide(state, contact, scratch->after + row + 1, NO_OUTLOOK);
    }
}

/* The laws see slips from the middle of a step. What rows turn by until its end would direct the friction of a slow
   slip in space; so its mode takes that back: slip + way = seen * after, ahead of the way. */
static void direct_slips(Instance *instance, double time, const double states[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, gaps, SIZE_UNILATERALS);
    WORK(mark, double, slips, SIZE_FRICTIONAL);
    State *state = &instance->state;
    mechanism_slips(time, states, inputs_at(instance, time), state->parameters, gaps, slips);
    for (int c = 0; c < N_UNILATERALS; c++) {
        const double *after = instance->scratch.solver.after + CONTACT_ROWS[c] + 1;
        const double *slip = slips + SLIP_ROWS[c] - FIRST_SLIP;
        if (contact_slides_in_space(state, c)) {
            const double along = after[0] * slip[0] + after[1] * slip[1];
            const double seen = fmax(1.0, 0.01 + along / (after[0] * after[0] + after[1] * after[1]));
            const double way[2] = {seen * after[0] - slip[0], seen * after[1] - slip[1]};
            const Outlook kept = {.steady = vector_length(way, 2)};
            contact_slide(state, c, way, kept);
        }
    }
    arena_release(mark);
}

/* A latch that begins to hold a position holds it where it is. */
static void settle_latch(Instance *instance, int latch) {
    const SolverScratch *scratch = &instance->scratch.solver;
    State *state = &instance->state;
    const int row = FIRST_LATCH + latch;
    const bool holds = state->parameters[N_MASKS + LATCH_SWITCHES[latch]] > 0.0;
    if (holds && !row_active(state, row) && latch < N_OFFSETS) {
        state->parameters[FIRST_OFFSET + latch] += scratch->end.positions[FIRST_LATCH_ROW + latch];
    }
    row_activate(state, row, holds);
}

void step_turn_switches(Instance *instance, double time, const double states[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, margins, N_SWITCHES + 1);
    double *switches = instance->state.parameters + N_MASKS;
    if (N_SWITCHES == 0) {
        arena_release(mark);
        return;
    }
    mechanism_switches(time, states, inputs_at(instance, time), instance->state.parameters, margins);
    for (int k = 0; k < N_SWITCHES; k++) {
        if (switches[k] * margins[k] < 0.0) {
            switches[k] = -switches[k];
            instance->cache.least_pivots_valid = false;
        }
    }
    arena_release(mark);
}

void step_modes(Instance *instance, double time, const double states[]) {
    const SolverScratch *scratch = &instance->scratch.solver;
    State *state = &instance->state;
    for (int c = 0; c < N_UNILATERALS; c++) {
        settle_contact(instance, c);
    }
    for (int i = 0; i < N_FRICTIONS; i++) {
        if (step_stops(scratch, FIRST_DRY_ROW + i)) {
            friction_stick(state, i);
        } else {
            friction_slide(state, i, scratch->after[FIRST_DRY_ROW + i]);
        }
    }
    const bool read = time >= instance->scratch.step_end || instance->listener.follow != NULL;
    if (read && contacts_slide_in_space(instance)) {
        direct_slips(instance, time, states);
    }
    step_turn_switches(instance, time, states);
    for (int i = 0; i < N_LATCHES; i++) {
        settle_latch(instance, i);
    }
    state->modes_settled = 1;
    state->rows_known = 0; /* those of the modes before */
    state->usual_known = 0;
}
