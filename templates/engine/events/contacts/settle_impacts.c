/* Impacts at one point: contacts that touch and approach, and latches that begin to hold what still moves. */
#include <math.h>
#include <string.h>

#include "accelerations.h"
#include "impacts_without_collision.h"
#include "inputs.h"
#include "notices.h"
#include "scale.h"
#include "settling.h"

/* In units of settling_least_speed: the rounding error that the laws of impact leave, where masses differ by orders of
   magnitude, of a velocity that they bring to rest. */
static const double LEFT = 100.0;

static bool approaches(const Settling *settling, int contact) {
    return settling->touching[contact] &&
           settling->velocity[ROW_PLACES[contact]] < -settling_least_speed(settling, contact);
}

static bool something_approaches(const Settling *settling) {
    const State *state = &settling->instance->state;
    bool found = false;
    for (int i = 0; i < N_UNILATERALS; i++) {
        found = found || approaches(settling, i);
    }
    for (int row = FIRST_LATCH; row < N_ROWS; row++) {
        found = found || (row_active(state, row) &&
                          fabs(settling->velocity[ROW_PLACES[row]]) > settling_least_speed(settling, row));
    }
    return found;
}

/* loaded[i]: does the closed contact i bear a normal force before the impact? */
static bool find_loads(const Settling *settling, bool loaded[]) {
    const ArenaMark mark = arena_mark(settling->instance->arena);
    WORK(mark, double, unknowns, N_UNKNOWNS);
    Instance *instance = settling->instance;
    const State *state = &instance->state;
    double greatest = 0.0;
    bool closed = false;
    memset(loaded, 0, SIZE_UNILATERALS * sizeof(bool));
    for (int i = 0; i < N_UNILATERALS; i++) {
        closed = closed || contact_closed(state, i);
    }
    if (!closed) {
        return arena_leave(mark, true);
    }
    if (!accelerations_at(instance, state->time, state->states, inputs_at(instance, state->time), unknowns)) {
        return arena_leave(mark, false);
    }
    for (int k = N; k < N_UNKNOWNS; k++) {
        greatest = fmax(greatest, fabs(unknowns[k]));
    }
    for (int i = 0; i < N_UNILATERALS; i++) {
        const double force = unknowns[N + ROW_PLACES[i]];
        loaded[i] = contact_closed(state, i) && force > OBEYED * greatest && settling_bears(settling, i, force);
    }
    return arena_leave(mark, true);
}

/* Fills contact[] with the contacts that touch, and which[] with their numbers; returns how many there are. */
static int gather_contacts(const Settling *settling, const bool loaded[], ImpactContact contact[], int which[]) {
    int count = 0;
    for (int i = 0; i < N_UNILATERALS; i++) {
        if (settling->touching[i]) {
            const int slips = contact_slips(i);
            which[count] = i;
            contact[count++] = (ImpactContact){.normal = ROW_PLACES[i],
                                               .slip = slips > 0 ? ROW_PLACES[SLIP_ROWS[i]] : 0,
                                               .slips = slips,
                                               .restitution = settling->restitution[i],
                                               .friction = settling->friction[i],
                                               .loaded = loaded[i],
                                               .slow = settling_least_speed(settling, i)};
        }
    }
    return count;
}

/* Velocities += M^-1 G^T impulses. A velocity that is no more than rounding of this sum becomes 0. */
static void move(Settling *settling, const double impulses[]) {
    double *qd = settling->instance->state.states + N;
    for (int i = 0; i < N; i++) {
        double change = 0.0, size = fabs(qd[i]);
        for (int k = 0; k < K; k++) {
            change += settling->response[k * N + i] * impulses[k];
            size = fmax(size, fabs(settling->response[k * N + i] * impulses[k]));
        }
        qd[i] = fabs(qd[i] + change) <= NOISE * size ? 0.0 : qd[i] + change;
    }
}

/* velocity[k] becomes 0 where the laws of impact have found velocities[k] = 0 and the states leave less than LEFT. */
static void rest(Settling *settling, const double velocities[]) {
    for (int row = 0; row < N_ROWS; row++) {
        const int k = ROW_PLACES[row];
        const bool little = fabs(settling->velocity[k]) <= LEFT * settling_least_speed(settling, row);
        settling->velocity[k] = velocities[k] == 0.0 && little ? 0.0 : settling->velocity[k];
    }
}

static void keep_result(Settling *settling, const ImpactResult *result, const int which[], int count) {
    State *state = &settling->instance->state;
    double greatest = 0.0;
    for (int i = 0; i < count; i++) {
        greatest = fmax(greatest, result->impulses[ROW_PLACES[which[i]]]);
    }
    for (int i = 0; i < count; i++) {
        const double impulse = result->impulses[ROW_PLACES[which[i]]];
        settling->rebounds[which[i]] = impulse > OBEYED * greatest;
        if (settling->rebounds[which[i]]) {
            state->impacts[which[i]]++;
            state->impulses[which[i]] = impulse;
        }
    }
}

/* Poisson's law returns a part of each velocity before[K] that no coefficient tells: friction takes its share. Where
   impacts accumulate, each returns the same part. */
static void note_returned(Settling *settling, const double before[]) {
    for (int i = 0; i < N_UNILATERALS; i++) {
        const int k = ROW_PLACES[i];
        if (settling->rebounds[i] && before[k] < 0.0) {
            const double part = fmax(settling->velocity[k], 0.0) / -before[k];
            settling->restitution[i] = fmin(settling->restitution[i], part);
        }
    }
}

/* Performs an impact at this point. Contacts in loaded[] take part though they do not approach. Without a collision it
   is the impact that stops a slip because sliding friction leaves no forces (Painleve's paradox). Returns false if
   there is no solution. */
static bool perform(Settling *settling, const bool loaded[], bool collision, bool *jumped) {
    const ArenaMark mark = arena_mark(settling->instance->arena);
    WORK(mark, bool, bilateral, K);
    WORK(mark, ImpactContact, contact, SIZE_CONTACTS);
    WORK_OF(mark, ImpactResult, result);
    WORK(mark, int, which, SIZE_CONTACTS);
    WORK(mark, double, before, K);
    const State *state = &settling->instance->state;
    memcpy(before, settling->velocity, K * sizeof(double));
    memcpy(bilateral, settling->permanent, K * sizeof(bool));
    for (int row = FIRST_LATCH; row < N_ROWS; row++) {
        bilateral[ROW_PLACES[row]] = row_active(state, row);
    }
    const int count = gather_contacts(settling, loaded, contact, which);
    const ImpactProblem problem = {mark.arena, K, settling->delassus, settling->velocity, bilateral, count, contact};
    const ImpactOrder order = SIMULTANEOUS_IMPACTS ? IMPACTS_SIMULTANEOUS : IMPACTS_SEQUENTIAL;
    if (!(collision ? impacts_solve(&problem, order, result) : impacts_without_collision(&problem, result))) {
        return arena_leave(mark, false);
    }
    move(settling, result->impulses);
    settling->instance->state.states[DISSIPATED] += result->lost;
    keep_result(settling, result, which, count);
    if (collision && count > 0 && (result->poisson || result->closed)) {
        give_notice(settling->instance, result->closed ? NOTICE_CLOSED : NOTICE_POISSON, 0.0,
                    N_SWITCHES + 2 * which[0]);
    }
    *jumped = true;
    if (!settling_measure(settling)) {
        return arena_leave(mark, false);
    }
    rest(settling, result->velocities);
    if (result->poisson) {
        note_returned(settling, before);
    }
    return arena_leave(mark, true);
}

/* Ends the cascade of each contact that an impact has lifted: it flies. */
static void end_lifted_cascades(Settling *settling) {
    State *state = &settling->instance->state;
    for (int i = 0; i < N_UNILATERALS; i++) {
        if (state->cascading[i] == CASCADE_RESTS &&
            settling->velocity[ROW_PLACES[i]] > settling_least_speed(settling, i)) {
            state->cascading[i] = CASCADE_NONE;
        }
    }
}

bool settling_impacts(Settling *settling, bool *jumped) {
    const ArenaMark mark = arena_mark(settling->instance->arena);
    WORK(mark, bool, loaded, SIZE_UNILATERALS);
    Instance *instance = settling->instance;
    if (!something_approaches(settling)) {
        return arena_leave(mark, true);
    }
    if (!find_loads(settling, loaded)) {
        return arena_leave(mark, false);
    }
    if (!perform(settling, loaded, true, jumped)) {
        return arena_leave(mark, settling_fail(instance));
    }
    end_lifted_cascades(settling);
    return arena_leave(mark, true);
}

bool settling_without_collision(Settling *settling, bool *jumped) {
    const ArenaMark mark = arena_mark(settling->instance->arena);
    WORK_ZEROS(mark, bool, loaded, SIZE_UNILATERALS);
    for (int i = 0; i < N_UNILATERALS; i++) {
        loaded[i] = settling->row[ROW_PLACES[i]].law == ROW_UNILATERAL;
    }
    if (!perform(settling, loaded, false, jumped)) {
        return arena_leave(mark, false);
    }
    for (int i = N_UNILATERALS - 1; i >= 0; i--) {
        if (settling->rebounds[i]) {
            give_notice(settling->instance, NOTICE_NO_FORCES, 0.0, N_SWITCHES + 2 * i);
        }
        settling->rebounds[i] = false;
    }
    return arena_leave(mark, true);
}
