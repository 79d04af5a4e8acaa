#include "late_impacts.h"

#include <math.h>
#include <string.h>

#include "accelerations.h"
#include "inputs.h"
#include "scale.h"

/* In units of the hysteresis: importers that locate events find gaps that deep, and no step of theirs leads there. */
static const double FOUND = 2.0;

/* The part of the square of its velocity that a gap has to have had where it was 0. Where it had less, as in rebounds
   that are much lower than the hysteresis, the square is a difference of errors. */
static const double ENTERED = 0.1;

/* How many gaps are due; 0 if anything else is. */
static int gaps_alone(const Settling *settling) {
    const State *state = &settling->instance->state;
    int count = 0;
    for (int k = 0; k < 2 * N_UNILATERALS + N_FRICTIONS; k++) {
        const bool gap = k < 2 * N_UNILATERALS && k % 2 == 0 && !contact_closed(state, k / 2);
        if (settling->due[k] && !gap) {
            return 0;
        }
        count += settling->due[k];
    }
    return count;
}

/* Moves the states by the time h, s, at these accelerations. */
static void move_by(State *state, double h, const double qdd[]) {
    for (int i = 0; i < N; i++) {
        state->states[i] += h * (state->states[N + i] + 0.5 * h * qdd[i]);
        state->states[N + i] += h * qdd[i];
    }
}

double impact_overlap(const Settling *settling, int contact) {
    const double depth = -settling->rows.positions[contact];
    return depth > FOUND * HYSTERESIS * row_size(&settling->rows, contact) ? depth : 0.0;
}

/* How long ago, s, the gap that is due was 0, on a parabola; HUGE_VAL where that is more than longest, s, and the gap
   deeper than where it is located, or where it is not told. */
static double time_of(const Settling *settling, int contact, const double qdd[], double longest) {
    const double gap = settling->rows.positions[contact], v = settling->rows.velocities[contact];
    /* Of the velocity where the gap was 0. */
    const double square = v * v - 2.0 * gap * row_acceleration(&settling->rows, contact, qdd);
    if (!(gap < 0.0 && v < 0.0 && square >= ENTERED * v * v)) {
        return HUGE_VAL;
    }
    const double ago = 2.0 * gap / (v - sqrt(square));
    return impact_overlap(settling, contact) == 0.0 || ago <= longest ? ago : HUGE_VAL;
}

bool impacts_go_back(Settling *settling, double *late) {
    const ArenaMark mark = arena_mark(settling->instance->arena);
    WORK(mark, double, unknowns, N_UNKNOWNS);
    Instance *instance = settling->instance;
    State *state = &instance->state;
    *late = 0.0;
    const int gaps = gaps_alone(settling);
    if (instance->policy->integrate || gaps == 0) {
        return arena_leave(mark, true);
    }
    /* A gap that is 0 since before the last step was set so. Several gaps were 0 at times of their own. */
    const double longest = gaps == 1 ? settling_last_step(instance) : 0.0;
    const double *inputs = inputs_at(instance, state->time);
    if (!accelerations_at(instance, state->time, state->states, inputs, unknowns)) {
        return arena_leave(mark, false);
    }
    rows_evaluate(instance, state->time, state->states, inputs, &settling->rows);
    for (int i = 0; i < N_UNILATERALS; i++) {
        *late = settling->due[2 * i] ? fmax(*late, time_of(settling, i, unknowns, longest)) : *late;
    }
    *late = *late < HUGE_VAL ? *late : 0.0;
    move_by(state, -*late, unknowns);
    state->time -= *late;
    return arena_leave(mark, true);
}

bool overlaps_unseen(const Settling *settling, int contact) {
    const double least = -0.5 * HYSTERESIS * row_size(&settling->rows, contact);
    return !contact_closed(&settling->instance->state, contact) && settling->rows.positions[contact] < least;
}

/* Notes as due the open gaps below 0, which the importer would not see close, and nothing else. Returns whether there
   are any. */
static bool find_overlaps(Settling *settling) {
    Instance *instance = settling->instance;
    const State *state = &instance->state;
    bool found = false;
    rows_evaluate(instance, state->time, state->states, inputs_at(instance, state->time), &settling->rows);
    memset(settling->due, 0, sizeof settling->due);
    for (int i = 0; i < N_UNILATERALS; i++) {
        settling->due[2 * i] = overlaps_unseen(settling, i);
        found = found || settling->due[2 * i];
    }
    return found;
}

bool impacts_catch_up(Settling *settling, double late, bool *jumped, bool *met) {
    const ArenaMark mark = arena_mark(settling->instance->arena);
    WORK(mark, double, unknowns, N_UNKNOWNS);
    WORK(mark, double, before, N_STATES);
    Instance *instance = settling->instance;
    State *state = &instance->state;
    *met = false;
    if (late == 0.0) {
        return arena_leave(mark, true);
    }
    const double *inputs = inputs_at(instance, state->time);
    const bool known = accelerations_at(instance, state->time, state->states, inputs, unknowns);
    memcpy(before, state->states, N_STATES * sizeof(double));
    if (known) {
        move_by(state, late, unknowns);
    }
    state->time += late;
    if (known && find_overlaps(settling)) {
        memcpy(state->states, before, N_STATES * sizeof(double));
        *met = find_overlaps(settling); /* with a surface that has moved on */
    }
    return arena_leave(mark, known && settling_move(settling, jumped));
}
