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

/* loaded[i]: does the contact i bear a normal force before the impact? */
static bool find_loads(Settling *settling, bool loaded[]) {
    const ArenaMark mark = arena_mark(settling->instance->arena);
    WORK(mark, double, unknowns, N_UNKNOWNS);
    Instance *instance = settling->instance;
    const State *state = &instance->state;
    double greatest = 0.0;
    bool closed = false;
    memset(loaded, 0, SIZE_UNILATERALS * sizeof(bool));
    if (state->phase == PHASE_SOLVING_START) { /* nothing is closed yet */
        settling_find_loads(settling, loaded);
        return arena_leave(mark, true);
    }
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

/* What belongs to an impact at this point. */
typedef struct {
    bool collision;
    double most_lever; /* without a collision: see impacts_without_collision */
    bool loaded[SIZE_UNILATERALS]; /* takes part though it does not approach */
    double start[N];               /* the velocities before; friction as it is there, in all rounds */
    double friction[SIZE_UNILATERALS];
    ImpactResult result;
    int which[SIZE_CONTACTS];
    int count; /* of contacts that touch */
} Impact;

/* Fills contact[] with the contacts that touch. */
static void gather_contacts(const Settling *settling, Impact *impact, ImpactContact contact[]) {
    impact->count = 0;
    for (int i = 0; i < N_UNILATERALS; i++) {
        if (settling->touching[i]) {
            const int slips = contact_slips(i);
            impact->which[impact->count] = i;
            contact[impact->count++] = (ImpactContact){.normal = ROW_PLACES[i],
                                               .slip = slips > 0 ? ROW_PLACES[SLIP_ROWS[i]] : 0,
                                               .slips = slips,
                                               .restitution = settling->restitution[i],
                                               .friction = impact->friction[i],
                                               .loaded = impact->loaded[i],
                                               .slow = settling_least_speed(settling, i)};
        }
    }
}

/* Velocities = start + M^-1 G^T impulses. A velocity that is no more than rounding of this sum becomes 0. */
static void move(Settling *settling, const double start[], const double impulses[]) {
    double *qd = settling->instance->state.states + N;
    for (int i = 0; i < N; i++) {
        double change = 0.0, size = fabs(start[i]);
        for (int k = 0; k < K; k++) {
            change += settling->response[k * N + i] * impulses[k];
            size = fmax(size, fabs(settling->response[k * N + i] * impulses[k]));
        }
        qd[i] = fabs(start[i] + change) <= NOISE * size ? 0.0 : start[i] + change;
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

/* The point behind a round. Where a contact no longer approaches, its restitution stays that of its impact. */
static bool measure_behind(Settling *settling, const double velocities[]) {
    const ArenaMark mark = arena_mark(settling->instance->arena);
    WORK(mark, double, restitution, SIZE_UNILATERALS);
    memcpy(restitution, settling->restitution, sizeof settling->restitution);
    const bool measured = settling_measure(settling);
    rest(settling, velocities);
    for (int i = 0; i < N_UNILATERALS; i++) {
        settling->restitution[i] = approaches(settling, i) ? settling->restitution[i] : restitution[i];
    }
    return arena_leave(mark, measured);
}

/* Finds the impulses up to where loads have to be found anew, and what they make of the velocities. */
static bool make_rounds(Settling *settling, Impact *impact) {
    const ArenaMark mark = arena_mark(settling->instance->arena);
    WORK(mark, bool, bilateral, K);
    WORK(mark, ImpactContact, contact, SIZE_CONTACTS);
    const State *state = &settling->instance->state;
    const ImpactOrder order = SIMULTANEOUS_IMPACTS ? IMPACTS_SIMULTANEOUS : IMPACTS_SEQUENTIAL;
    memcpy(bilateral, settling->permanent, K * sizeof(bool));
    for (int row = FIRST_LATCH; row < N_ROWS; row++) {
        bilateral[ROW_PLACES[row]] = row_active(state, row);
    }
    gather_contacts(settling, impact, contact);
    const ImpactProblem problem = {mark.arena, K,       settling->delassus, settling->velocity,
                                   bilateral,  impact->count, contact, CHANGING_RESTITUTION};
    if (!(impact->collision ? impacts_solve(&problem, order, &impact->result)
                            : impacts_without_collision(&problem, impact->most_lever, &impact->result))) {
        return arena_leave(mark, false);
    }
    move(settling, impact->start, impact->result.impulses);
    return arena_leave(mark, measure_behind(settling, impact->result.velocities));
}

/* Performs an impact at this point. Without a collision it is the impact that stops a slip because sliding friction
   leaves no forces (Painleve's paradox). Returns false if there is no solution. */
static bool perform(Settling *settling, Impact *impact, bool *jumped) {
    const ArenaMark mark = arena_mark(settling->instance->arena);
    WORK(mark, double, before, K);
    State *state = &settling->instance->state;
    const ImpactResult *result = &impact->result;
    memcpy(before, settling->velocity, K * sizeof(double));
    memcpy(impact->start, state->states + N, N * sizeof(double));
    memcpy(impact->friction, settling->friction, sizeof impact->friction);
    for (int rounds = -1; rounds < result->rounds;) {
        rounds = result->rounds;
        if (!make_rounds(settling, impact)) {
            return arena_leave(mark, false);
        }
        *jumped = true;
        if (!impact->collision || SIMULTANEOUS_IMPACTS || result->closed || !something_approaches(settling)) {
            break;
        }
        settling_find_loads(settling, impact->loaded);
    }
    state->states[DISSIPATED] += result->lost;
    keep_result(settling, result, impact->which, impact->count);
    if (impact->collision && impact->count > 0 && (result->poisson || result->closed)) {
        give_notice(settling->instance, result->closed ? NOTICE_CLOSED : NOTICE_POISSON, 0.0,
                    N_SWITCHES + 2 * impact->which[0]);
    }
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
    WORK_OF(mark, Impact, impact);
    Instance *instance = settling->instance;
    memset(impact, 0, sizeof *impact);
    if (!something_approaches(settling)) {
        return arena_leave(mark, true);
    }
    impact->collision = true;
    if (!find_loads(settling, impact->loaded)) {
        return arena_leave(mark, false);
    }
    if (!perform(settling, impact, jumped)) {
        return arena_leave(mark, settling_fail(instance));
    }
    end_lifted_cascades(settling);
    return arena_leave(mark, true);
}

bool settling_without_collision(Settling *settling, double most_lever, bool *jumped) {
    const ArenaMark mark = arena_mark(settling->instance->arena);
    WORK_OF(mark, Impact, impact);
    memset(impact, 0, sizeof *impact);
    impact->most_lever = most_lever;
    for (int i = 0; i < N_UNILATERALS; i++) {
        impact->loaded[i] = settling->row[ROW_PLACES[i]].law == ROW_UNILATERAL;
    }
    if (!perform(settling, impact, jumped)) {
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
