/* Impacts: M (qd+ - qd-) = G^T P. In units of impulses and velocities the laws are those of forces and accelerations,
   with w = v+ + e v- of normal rows: Moreau, Unilateral contact and dry friction in finite freedom dynamics, 1988. */
#include <math.h>
#include <string.h>

#include "complementarity.h"
#include "settling.h"

enum { N = N_COORDINATES, K = N_CONSTRAINTS, MOST_ROUNDS = 1000 };

static bool approaches(const Settling *settling, int contact) {
    return settling->touching[contact] &&
           settling->velocity[ROW_PLACES[contact]] < -settling_least_speed(settling, contact);
}

/* Does a latch hold that still moves? */
static bool latch_moves(const Settling *settling) {
    const State *state = &settling->instance->state;
    bool found = false;
    for (int row = FIRST_LATCH; row < N_ROWS; row++) {
        found = found || (row_active(state, row) &&
                          fabs(settling->velocity[ROW_PLACES[row]]) > settling_least_speed(settling, row));
    }
    return found;
}

static bool something_approaches(const Settling *settling) {
    bool found = latch_moves(settling);
    for (int i = 0; i < N_UNILATERALS; i++) {
        found = found || approaches(settling, i);
    }
    return found;
}

static bool takes_part(const Settling *settling, int contact) {
    const bool rests = settling->velocity[ROW_PLACES[contact]] <= settling_least_speed(settling, contact);
    return approaches(settling, contact) || (settling->touching[contact] && (SIMULTANEOUS_IMPACTS || (rests &&
           contact_closed(&settling->instance->state, contact))));
}

/* One round: the laws of all rows, and what w is without impulses. */
static void set_rows(Settling *settling, double free[]) {
    const State *state = &settling->instance->state;
    memcpy(free, settling->velocity, K * sizeof(double));
    for (int k = 0; k < K; k++) {
        settling->row[k] = (Row){.law = settling->permanent[k] ? ROW_BILATERAL : ROW_FREE};
    }
    for (int row = FIRST_LATCH; row < N_ROWS; row++) {
        settling->row[ROW_PLACES[row]].law = row_active(state, row) ? ROW_BILATERAL : ROW_FREE;
    }
    for (int i = 0; i < N_UNILATERALS; i++) {
        const int k = ROW_PLACES[i];
        if (!takes_part(settling, i)) {
            continue;
        }
        settling->row[k].law = ROW_UNILATERAL;
        free[k] += approaches(settling, i) ? settling->restitution[i] * settling->velocity[k] : 0.0;
        for (int row = SLIP_ROWS[i]; row < SLIP_ROWS[i + 1]; row++) {
            settling->row[ROW_PLACES[row]] = (Row){.law = ROW_TANGENTIAL, .normal = k,
                                                   .friction = settling->friction[i], .holding = settling->friction[i]};
        }
    }
}

/* Changes the velocities by the impulses lambda. */
static void apply(Settling *settling) {
    double *qd = settling->instance->state.states + N;
    for (int i = 0; i < N; i++) {
        double change = 0.0;
        for (int k = 0; k < K; k++) {
            change += settling->response[k * N + i] * settling->lambda[k];
        }
        const double size = fabs(qd[i]) + fabs(change);
        qd[i] = fabs(qd[i] + change) <= 1e-15 * size ? 0.0 : qd[i] + change;
    }
    for (int k = 0; k < K; k++) {
        for (int j = 0; j < K; j++) {
            settling->velocity[k] += settling->delassus[k * K + j] * settling->lambda[j];
        }
    }
}

static void count(Settling *settling, double impulses[]) {
    for (int i = 0; i < N_UNILATERALS; i++) {
        const double impulse = settling->lambda[ROW_PLACES[i]];
        impulses[i] += impulse;
        settling->rebounds[i] = settling->rebounds[i] || impulse > 0.0;
    }
}

bool settling_impacts(Settling *settling, bool *jumped) {
    State *state = &settling->instance->state;
    double free[K], impulses[SIZE_UNILATERALS] = {0.0};
    const Problem problem = {K, settling->delassus, free, settling->row};
    if (!something_approaches(settling)) {
        return true;
    }
    for (int round = 0; round < MOST_ROUNDS && something_approaches(settling); round++) {
        set_rows(settling, free);
        if (!complementarity_solve(&problem, settling->lambda, settling->w)) {
            settling->instance->failure.kind = FAILURE_MODES;
            settling->instance->failure.time = state->time;
            return false;
        }
        count(settling, impulses);
        apply(settling);
    }
    for (int i = 0; i < N_UNILATERALS; i++) {
        if (impulses[i] > 0.0) {
            state->impacts[i]++;
            state->impulses[i] = impulses[i];
        }
    }
    *jumped = true;
    return settling_measure(settling);
}
