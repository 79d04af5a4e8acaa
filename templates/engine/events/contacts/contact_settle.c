/* Modes at an event. First latches follow their switches, then impacts take place, then modes are chosen that forces
   and accelerations allow. In the end the states are moved onto the rows that hold. Pfeiffer, Glocker, Multibody
   Dynamics with Unilateral Contacts, 1996, chapters 5 and 8. */
#include <math.h>
#include <string.h>

#include "accelerations.h"
#include "constraints.h"
#include "contact_events.h"
#include "contacts.h"
#include "failure.h"
#include "inputs.h"
#include "late_impacts.h"
#include "scale.h"
#include "settings.h"
#include "settling.h"
#include "stopping_slips.h"
#include "system.h"

/* Latches obey their switches. A latch that begins to hold a position holds it where it is. Returns whether one begins
   to hold or lets go. */
static bool update_latches(Settling *settling) {
    State *state = &settling->instance->state;
    bool changed = false;
    for (int i = 0; i < N_LATCHES; i++) {
        const int row = FIRST_LATCH + i;
        const bool holds = state->parameters[N_MASKS + LATCH_SWITCHES[i]] > 0.0;
        changed = changed || holds != row_active(state, row);
        if (holds && !row_active(state, row) && i < N_OFFSETS) {
            state->parameters[FIRST_OFFSET + i] = settling->rows.positions[FIRST_OFFSET_ROW + i];
        }
        row_activate(state, row, holds);
    }
    return changed;
}

/* Marks the contacts that are closed and those whose gap is 0 here. */
static void find_touching(Settling *settling) {
    const State *state = &settling->instance->state;
    for (int i = 0; i < N_UNILATERALS; i++) {
        settling->touching[i] = contact_closed(state, i) || settling_meets(settling, i);
    }
}

static void forget_modes(State *state) {
    for (int i = 0; i < N_UNILATERALS; i++) {
        contact_open(state, i);
    }
    for (int i = 0; i < N_FRICTIONS; i++) {
        friction_stick(state, i);
    }
    for (int i = 0; i < N_LATCHES; i++) {
        row_activate(state, FIRST_LATCH + i, false);
    }
}

/* Is the contact at the top of the last rebound of its cascade? */
static bool at_top(const Settling *settling, int contact) {
    const State *state = &settling->instance->state;
    return state->cascading[contact] == CASCADE_RISES &&
           (settling->due[2 * contact + 1] || state->time >= state->top_time[contact]);
}

/* Ends cascades whose time is over, or whose contact bears nothing or comes down before the top. From here on the event
   function of a contact at rest is its force alone; the rounding error of its product with the time is forgotten. */
static void end_cascades(Settling *settling) {
    State *state = &settling->instance->state;
    for (int i = 0; i < N_UNILATERALS; i++) {
        const bool over = state->cascading[i] == CASCADE_RESTS && state->time >= state->rest_time[i];
        if (state->cascading[i] && (settling->due[2 * i] || over) && !at_top(settling, i)) {
            double *rest = &state->event_rests[N_SWITCHES + 2 * i];
            *rest = state->cascading[i] == CASCADE_RESTS ? 0.0 : *rest;
            state->cascading[i] = CASCADE_NONE;
        }
    }
}

/* Do the velocities in states[N_STATES] differ from the present ones by no more than errors of an event's location? */
static bool changes_little(const Settling *settling, const double states[]) {
    const State *state = &settling->instance->state;
    const double most = LOCATED * states_pace(state);
    bool little = true;
    for (int i = 0; i < N; i++) {
        little = little && fabs(states[N + i] - state->states[N + i]) <= most * NOMINAL_STATES[i];
    }
    return little;
}

/* Brings slips along a line to rest that are due and that friction then holds. The velocity left of them is the error
   of the event's location, or what an importer's step has gained beyond the stop. A greater velocity is neither, for
   example one that the importer has just set; such a slip turns or goes on. */
static bool stop_slips(Settling *settling, bool *jumped) {
    const ArenaMark mark = arena_mark(settling->instance->arena);
    WORK(mark, double, states, N_STATES);
    WORK_OF(mark, StoppingSlips, slips);
    if (!slips_find(settling, slips)) {
        return arena_leave(mark, true);
    }
    if (!settling_measure(settling)) {
        return arena_leave(mark, false);
    }
    find_touching(settling);
    if (*jumped) {
        slips_forget_moving(settling, slips);
    }
    slips_stop(settling, slips);
    if (slips->stopped && settling_find_states(settling, states) &&
        (slips->within_step || changes_little(settling, states))) {
        settling_take(settling, states, jumped);
    } else if (slips->stopped) {
        slips_pass(settling, slips);
    }
    return arena_leave(mark, true);
}

/* What a force of 1 along the gap accelerates it by, m/s^2 or rad/s^2, beside what holds, or 0 where that holds the gap
   too, but for rounding. The system is factorised. */
static double mobility(const Settling *settling, const System *system, int contact) {
    const ArenaMark mark = arena_mark(settling->instance->arena);
    WORK_ZEROS(mark, double, change, N_UNKNOWNS);
    WORK(mark, double, answer, N_UNKNOWNS);
    const double *row = settling->rows.jacobian + contact * N;
    double moved = 0.0;
    for (int i = 0; i < N; i++) {
        change[i] = -row[i];
    }
    system_answer(system, change, answer);
    for (int i = 0; i < N; i++) {
        moved += row[i] * answer[i];
    }
    arena_release(mark);
    return moved > OBEYED * settling->delassus[ROW_PLACES[contact] * (K + 1)] ? moved : 0.0;
}

/* How far below 0 a gap that is due may be before its next event. The next impact is not as far inside as this one. But
   a gap that grows was no impact: the importer's solver is wrong by so much, and will be so again. */
static double next_rest(const Settling *settling, int contact) {
    return settling->rows.velocities[contact] > 0.0 ? fmax(-settling->rows.positions[contact], 0.0) : 0.0;
}

/* An importer's solver ends its step at an impact with a gap a little below 0. Moves the coordinates so that the gaps
   that are due are 0 and none is negative after the event. Where not all of them can be 0, nothing is moved. */
static bool undo_overlap(Settling *settling, bool *jumped) {
    const ArenaMark mark = arena_mark(settling->instance->arena);
    WORK(mark, double, states, N_STATES);
    WORK(mark, bool, open, SIZE_UNILATERALS);
    Instance *instance = settling->instance;
    State *state = &instance->state;
    bool found = false, moved;
    for (int i = 0; i < N_UNILATERALS; i++) {
        open[i] = !contact_closed(state, i);
        found = found || (open[i] && settling->due[2 * i]);
    }
    if (instance->policy->integrate || !found) {
        return arena_leave(mark, true);
    }
    rows_evaluate(instance, state->time, state->states, inputs_at(instance, state->time), &settling->rows);
    for (int i = 0; i < N_UNILATERALS; i++) {
        settling->overlap[i] = open[i] && settling->due[2 * i] ? impact_overlap(settling, i) : 0.0;
        row_activate(state, i, !open[i] || settling_meets(settling, i));
    }
    memcpy(states, state->states, N_STATES * sizeof(double));
    const bool touch = constraints_regroup(instance) &&
                       constraints_project(instance, state->time, inputs_at(instance, state->time), states, &moved);
    for (int i = 0; i < N_UNILATERALS; i++) {
        row_activate(state, i, !open[i]);
        if (touch && open[i] && settling->due[2 * i]) {
            state->event_rests[N_SWITCHES + 2 * i] = next_rest(settling, i);
        }
    }
    if (touch) {
        *jumped = *jumped || memcmp(states, state->states, N * sizeof(double)) != 0;
        memcpy(state->states, states, N * sizeof(double));
    }
    return arena_leave(mark, settling_move(settling, jumped));
}

/* What an importer would not see: open gaps that others have drawn below 0 where these were closed. They are met. */
static bool meet_overlaps(Settling *settling, bool *jumped) {
    Instance *instance = settling->instance;
    const State *state = &instance->state;
    rows_evaluate(instance, state->time, state->states, inputs_at(instance, state->time), &settling->rows);
    for (int i = 0; i < N_UNILATERALS; i++) {
        settling->due[2 * i] = settling->due[2 * i] || overlaps_unseen(settling, i);
    }
    return undo_overlap(settling, jumped);
}

/* Closes contacts at the top of the last rebound of their cascade, which is lower than the tolerance, unless other
   contacts have thrown them higher since. The energy of their height and velocity counts as dissipated. */
static bool close_at_top(Settling *settling, bool *jumped) {
    const ArenaMark mark = arena_mark(settling->instance->arena);
    WORK(mark, double, unknowns, N_UNKNOWNS);
    Instance *instance = settling->instance;
    State *state = &instance->state;
    System *system = &instance->scratch.system;
    bool found = false, closed = false;
    for (int i = 0; i < N_UNILATERALS; i++) {
        found = found || at_top(settling, i);
    }
    if (!found) {
        return arena_leave(mark, true);
    }
    const double *inputs = inputs_at(instance, state->time);
    if (!settling_measure(settling) ||
        !accelerations_at(instance, state->time, state->states, inputs, unknowns) ||
        !system_factorize(instance, state->time, state->states, inputs, N_CONSTRAINTS, 0.0, system)) {
        return arena_leave(mark, false);
    }
    for (int i = 0; i < N_UNILATERALS; i++) {
        const double gap = settling->rows.positions[i], v = settling->velocity[ROW_PLACES[i]];
        const double a = -row_acceleration(&settling->rows, i, unknowns);
        const double up = fmax(v, 0.0), low = 2.0 * settling_least_rebound(settling, i);
        if (!at_top(settling, i)) {
            continue;
        }
        const double moves = mobility(settling, system, i);
        state->cascading[i] = CASCADE_NONE;
        settling->due[2 * i] = settling->due[2 * i + 1] = false;
        if (a > 0.0 && gap + 0.5 * up * up / a <= low) {
            state->states[DISSIPATED] += moves > 0.0 ? (a * gap + 0.5 * v * v) / moves : 0.0;
            settling_close(settling, i);
            state->cascading[i] = CASCADE_RESTS;
            closed = true;
        }
    }
    return arena_leave(mark, !closed || (settling_move(settling, jumped) && meet_overlaps(settling, jumped)));
}

bool contacts_undo_drift(Instance *instance, bool *jumped) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_OF(mark, Settling, settling);
    if (!contacts_hold(instance) || !instance->policy->stabilise) {
        return arena_leave(mark, true);
    }
    memset(settling, 0, sizeof *settling);
    settling->instance = instance;
    return arena_leave(mark, settling_move(settling, jumped));
}

/* Is every gap at the start 0 or more, but for TYPED of its nominal value? */
static bool starts_apart(Settling *settling) {
    Instance *instance = settling->instance;
    for (int i = 0; i < N_UNILATERALS; i++) {
        const double gap = settling->rows.positions[i];
        if (gap < -TYPED * row_size(&settling->rows, i)) {
            return report_constraint(instance, FAILURE_PENETRATION, instance->state.time, ROW_PLACES[i], gap);
        }
    }
    return true;
}

/* The size of the force along a row: the greater of the terms whose sum it is, and of the force that accelerates from
   rest to the least pace in the inverse of that pace. */
static double force_size(const Settling *settling, int row) {
    const int k = ROW_PLACES[row];
    const double own = settling->delassus[k * K + k], pace = states_least_pace(&settling->instance->state);
    double terms = fmax(fabs(settling->free[k]), pace * pace * row_size(&settling->rows, row));
    for (int j = 0; j < K; j++) {
        terms += fabs(settling->delassus[k * K + j] * settling->lambda[j]);
    }
    return own > 0.0 ? terms / own : 1.0;
}

/* Sets the size of an event function: that of the force where the row holds, else the size `without`. While a row holds
   its size does not fall: when its force comes down to 0, its rounding error is still that of the greater forces. */
static void note_size(const Settling *settling, int row, double without, double *size) {
    *size = row_active(&settling->instance->state, row) ? fmax(*size, force_size(settling, row)) : without;
}

/* Notes the sizes of the event functions in the modes that have been chosen. */
static void note_sizes(Settling *settling) {
    State *state = &settling->instance->state;
    const double *nominal = EVENT_NOMINALS + N_SWITCHES;
    const double pace = states_least_pace(state);
    double *size = state->contact_sizes;
    for (int i = 0; i < N_UNILATERALS; i++) {
        const int k = 2 * i + 1;
        note_size(settling, i, nominal[k - 1], size + k - 1);
        if (contact_closed(state, i) && contact_slips(i) > 0) {
            note_size(settling, SLIP_ROWS[i], pace * nominal[k], size + k);
        } else {
            size[k] = 1.0 / pace; /* of the time to the top of a rebound */
        }
    }
    for (int i = 0; i < N_FRICTIONS; i++) {
        const int k = 2 * N_UNILATERALS + i;
        note_size(settling, FIRST_FRICTION + i, pace * nominal[k], size + k);
    }
}

/* Does nothing hold, and is nothing due but gaps? */
static bool flies(const Instance *instance, const bool due[]) {
    bool free = due != NULL && !contacts_hold(instance);
    for (int k = 0; k < 2 * N_UNILATERALS + N_FRICTIONS && free; k++) {
        free = !due[k] || (k < 2 * N_UNILATERALS && k % 2 == 0);
    }
    return free;
}

/* Is no event function of contacts due? */
static bool nothing_due(const bool due[]) {
    bool found = false;
    for (int k = 0; k < 2 * N_UNILATERALS + N_FRICTIONS; k++) {
        found = found || due[k];
    }
    return !found;
}

/* Impacts, modes and the motion that they allow, at the measured point. */
static bool settle_there(Settling *settling, bool *collided, bool *moved) {
    find_touching(settling);
    return settling_impacts(settling, collided) && settling_modes(settling, moved) && settling_move(settling, moved) &&
           settling_relieve(settling);
}

/* Settles the contacts that are due because the motion has met them while it caught up behind an impact. */
static bool settle_what_met(Settling *settling, bool *collided, bool *moved) {
    memset(settling->rebounds, 0, sizeof settling->rebounds);
    return undo_overlap(settling, moved) && settling_measure(settling) && settle_there(settling, collided, moved);
}

bool contacts_settle(Instance *instance, const bool due[], bool *jumped, bool *again) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_OF(mark, Settling, settling);
    memset(settling, 0, sizeof *settling);
    settling->instance = instance;
    const bool flew = flies(instance, due);
    bool collided = false, moved = false, met;
    double late = 0.0;
    instance->arena->refused = 0;
    if (due == NULL) {
        forget_modes(&instance->state);
    } else {
        memcpy(settling->due, due, (2 * N_UNILATERALS + N_FRICTIONS) * sizeof(bool));
        settling->only_switched = N_SWITCHES > 0 && nothing_due(due);
    }
    end_cascades(settling);
    if (due != NULL && !impacts_go_back(settling, &late)) {
        return arena_leave(mark, false);
    }
    if (!undo_overlap(settling, &moved) || !close_at_top(settling, &moved)) {
        return arena_leave(mark, false);
    }
    if (!stop_slips(settling, &moved) || !settling_stop_in_space(settling, &moved) || !settling_measure(settling)) {
        return arena_leave(mark, false);
    }
    if (due == NULL && !starts_apart(settling)) {
        return arena_leave(mark, false);
    }
    update_latches(settling);
    if (!settle_there(settling, &collided, &moved) || !impacts_catch_up(settling, late, &moved, &met) ||
        (met && !settle_what_met(settling, &collided, &moved)) ||
        !contacts_oppose(instance, instance->state.time, instance->state.states, NULL)) {
        return arena_leave(mark, false);
    }
    note_sizes(settling);
    *jumped = *jumped || collided || moved;
    *again = *again || moved || (collided && !(flew && !contacts_hold(instance))); /* in flight impacts decide alone */
    return arena_leave(mark, true);
}
