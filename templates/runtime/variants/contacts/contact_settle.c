/* Modes at an event. First latches follow their switches, then impacts take place, then modes are chosen that forces
   and accelerations allow. In the end the states are moved onto the rows that hold. Pfeiffer, Glocker, Multibody
   Dynamics with Unilateral Contacts, 1996, chapters 5 and 8. */
#include <math.h>
#include <string.h>

#include "constraints.h"
#include "contacts.h"
#include "inputs.h"
#include "mass_matrix.h"
#include "settling.h"
#include "stopping_slips.h"
#include "system.h"

enum { N = N_COORDINATES, K = N_CONSTRAINTS };

/* A gap is closed, and a velocity 0, to this part of nominal values. */
static const double TOUCHING = 1e-10, AT_REST = 1e-10;

/* A start may be typed with few digits: a gap that is negative by less than this part of nominal values is closed. */
static const double CLOSED_AT_START = 1e-6;

/* Velocities at an event are exact but for this part of the greatest one; those of an importer's solver are less so. */
static const double LOCATED = 1e-6, LOCATED_LOOSELY = 1e-2;

bool settling_due(const Settling *settling, int function) {
    return settling->due[function];
}

/* The greatest velocity in nominal values, at least 1/s. */
static double pace(const State *state) {
    double greatest = 1.0;
    for (int i = 0; i < N; i++) {
        greatest = fmax(greatest, fabs(state->states[N + i]) / NOMINAL_STATES[i]);
    }
    return greatest;
}

double settling_least_speed(const Settling *settling, int row) {
    return AT_REST * pace(&settling->instance->state) * row_size(&settling->rows, row);
}

bool settling_bears(const Settling *settling, int contact, double force) {
    const int k = ROW_PLACES[contact];
    return force * settling->delassus[k * K + k] * DEFAULT_SOLVER_STEP > settling_least_speed(settling, contact);
}

/* The rows of all constraints: those that modes switch without their masks. */
static void gather_rows(Settling *settling, const System *system, double gamma[]) {
    memcpy(settling->jacobian, system->constraints.jacobian, sizeof settling->jacobian);
    memcpy(gamma, system->gamma, K * sizeof(double));
    memset(settling->velocity, 0, sizeof settling->velocity);
    for (int k = 0; k < K; k++) {
        settling->permanent[k] = true;
    }
    for (int row = 0; row < N_ROWS; row++) {
        const int k = ROW_PLACES[row];
        memcpy(settling->jacobian + k * N, settling->rows.jacobian + row * N, N * sizeof(double));
        gamma[k] = settling->rows.gamma[row];
        settling->velocity[k] = settling->rows.velocities[row];
        settling->permanent[k] = false;
    }
}

static double dot(const double a[], const double b[]) {
    double sum = 0.0;
    for (int i = 0; i < N; i++) {
        sum += a[i] * b[i];
    }
    return sum;
}

static bool report_law(Settling *settling, FailureKind kind, int contact, double coefficient) {
    Failure *failure = &settling->instance->failure;
    failure->kind = kind;
    failure->time = settling->instance->state.time;
    failure->count = ROW_PLACES[contact];
    failure->amount = coefficient;
    return false;
}

/* The coefficients of the contacts at the present parameters, if the laws of contact have a meaning for them. */
static bool find_coefficients(Settling *settling) {
    const State *state = &settling->instance->state;
    mechanism_contacts(state->time, state->states, inputs_at(settling->instance, state->time), state->parameters,
                       settling->restitution, settling->friction, settling->holding);
    for (int i = 0; i < N_UNILATERALS; i++) {
        const double restitution = settling->restitution[i], friction = settling->friction[i];
        if (!(restitution >= 0.0 && restitution <= 1.0)) {
            return report_law(settling, FAILURE_RESTITUTION, i, restitution);
        }
        if (!(friction >= 0.0)) {
            return report_law(settling, FAILURE_FRICTION, i, friction);
        }
    }
    return true;
}

bool settling_measure(Settling *settling) {
    Instance *instance = settling->instance;
    const State *state = &instance->state;
    System *system = &instance->scratch.system;
    const double *inputs = inputs_at(instance, state->time);
    double gamma[K], acceleration[N];
    if (!system_factorize(instance, state->time, state->states, inputs, 0, 0.0, system)) {
        return false;
    }
    if (!find_coefficients(settling)) {
        return false;
    }
    rows_evaluate(instance, state->time, state->states, inputs, &settling->rows);
    gather_rows(settling, system, gamma);
    mass_divide(system, system->forcing, acceleration);
    for (int k = 0; k < K; k++) {
        mass_divide(system, settling->jacobian + k * N, settling->response + k * N);
        settling->free[k] = gamma[k] + dot(settling->jacobian + k * N, acceleration);
    }
    for (int k = 0; k < K; k++) {
        for (int j = 0; j <= k; j++) {
            const double entry = dot(settling->jacobian + k * N, settling->response + j * N);
            settling->delassus[k * K + j] = entry;
            settling->delassus[j * K + k] = entry;
        }
    }
    return true;
}

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

/* Does the contact come to be closed here, or touch by chance? */
static bool meets(const Settling *settling, int contact) {
    return settling_due(settling, 2 * contact) ||
           settling->rows.positions[contact] <= TOUCHING * row_size(&settling->rows, contact);
}

/* Contacts that are closed, that come to be closed here, and those that touch by chance. */
static void find_touching(Settling *settling) {
    const State *state = &settling->instance->state;
    for (int i = 0; i < N_UNILATERALS; i++) {
        settling->touching[i] = contact_closed(state, i) || meets(settling, i);
    }
}

static void forget_modes(State *state) {
    for (int i = 0; i < N_UNILATERALS; i++) {
        contact_open(state, i);
        state->cascading[i] = 0;
    }
    for (int i = 0; i < N_FRICTIONS; i++) {
        friction_stick(state, i);
    }
    for (int i = 0; i < N_LATCHES; i++) {
        row_activate(state, FIRST_LATCH + i, false);
    }
}

/* Ends accumulations of impacts whose time is over. */
static void end_cascades(Settling *settling) {
    State *state = &settling->instance->state;
    for (int i = 0; i < N_UNILATERALS; i++) {
        if (state->cascading[i] && (settling_due(settling, 2 * i) || state->time >= state->rest_time[i])) {
            state->cascading[i] = 0;
        }
    }
}

/* states[N_STATES] = the present ones, moved onto the rows that the modes hold. Velocities that are rounding errors
   become 0, so that a body at rest does not creep. */
static bool find_on_modes(Settling *settling, double states[]) {
    Instance *instance = settling->instance;
    State *state = &instance->state;
    bool moved;
    state->usual_known = 0;
    memcpy(states, state->states, sizeof state->states);
    if (!constraints_regroup(instance) ||
        !constraints_project(instance, state->time, inputs_at(instance, state->time), states, &moved)) {
        return false;
    }
    const double dust = 1e-13 * pace(state);
    for (int i = 0; i < N; i++) {
        if (fabs(states[N + i]) <= dust * NOMINAL_STATES[i]) {
            states[N + i] = 0.0;
        }
    }
    return true;
}

static void take(Settling *settling, const double states[], bool *jumped) {
    State *state = &settling->instance->state;
    *jumped = *jumped || memcmp(states, state->states, sizeof state->states) != 0;
    memcpy(state->states, states, sizeof state->states);
}

bool settling_move(Settling *settling, bool *jumped) {
    double states[N_STATES];
    if (!find_on_modes(settling, states)) {
        return false;
    }
    take(settling, states, jumped);
    return true;
}

/* Is no velocity of the states[N_STATES] farther from the present one than errors of the location make it? */
static bool changes_little(const Settling *settling, const double states[]) {
    const Instance *instance = settling->instance;
    const State *state = &instance->state;
    const double most = (instance->policy->stabilise ? LOCATED_LOOSELY : LOCATED) * pace(state);
    bool little = true;
    for (int i = 0; i < N; i++) {
        little = little && fabs(states[N + i] - state->states[N + i]) <= most * NOMINAL_STATES[i];
    }
    return little;
}

/* Slips along a line that are due are at rest: what is left of them is the error of the location. But a slip may be 0
   because the mechanism is in a position where its velocities do not make it slip, as a slider at the dead centre of
   its crank. No friction holds it there: it goes on in the other direction. */
static void stop_slips(Settling *settling, bool *jumped) {
    double states[N_STATES];
    StoppingSlips slips;
    if (!slips_stop(settling, &slips)) {
        return;
    }
    if (find_on_modes(settling, states) && changes_little(settling, states)) {
        take(settling, states, jumped);
    } else {
        slips_pass(settling, &slips);
    }
}

bool contacts_undo_drift(Instance *instance, bool *jumped) {
    bool closed = false;
    for (int i = 0; i < N_UNILATERALS; i++) {
        closed = closed || contact_closed(&instance->state, i);
    }
    if (!closed || !instance->policy->stabilise) {
        return true;
    }
    Settling settling = {.instance = instance};
    return settling_move(&settling, jumped);
}

/* An importer's solver locates an impact where the indicator is 0, a little inside: bodies that meet are put back to
   where they touch, so that no gap is negative after the event. If they cannot all touch, they stay where they are. */
static bool undo_overlap(Settling *settling, bool *jumped) {
    Instance *instance = settling->instance;
    State *state = &instance->state;
    double states[N_STATES];
    bool open[SIZE_UNILATERALS], found = false, moved;
    for (int i = 0; i < N_UNILATERALS; i++) {
        open[i] = !contact_closed(state, i);
        found = found || (open[i] && settling_due(settling, 2 * i));
    }
    if (!found || !instance->policy->stabilise) {
        return true;
    }
    rows_evaluate(instance, state->time, state->states, inputs_at(instance, state->time), &settling->rows);
    for (int i = 0; i < N_UNILATERALS; i++) {
        row_activate(state, i, !open[i] || meets(settling, i));
    }
    memcpy(states, state->states, sizeof states);
    const bool touch = constraints_regroup(instance) &&
                       constraints_project(instance, state->time, inputs_at(instance, state->time), states, &moved);
    for (int i = 0; i < N_UNILATERALS; i++) {
        row_activate(state, i, !open[i]);
        if (touch && open[i] && settling_due(settling, 2 * i)) {
            state->event_rests[N_SWITCHES + 2 * i] = 0.0; /* the next impact is not as far inside */
        }
    }
    if (touch) {
        *jumped = *jumped || memcmp(states, state->states, N * sizeof(double)) != 0;
        memcpy(state->states, states, N * sizeof(double));
    }
    state->usual_known = 0;
    return constraints_regroup(instance);
}

/* Is no gap negative at the start? Gaps that are closed but for a part of nominal values are. */
static bool starts_apart(Settling *settling) {
    Failure *failure = &settling->instance->failure;
    for (int i = 0; i < N_UNILATERALS; i++) {
        if (settling->rows.positions[i] < -CLOSED_AT_START * row_size(&settling->rows, i)) {
            failure->kind = FAILURE_PENETRATION;
            failure->time = settling->instance->state.time;
            failure->count = ROW_PLACES[i];
            failure->amount = settling->rows.positions[i];
            return false;
        }
    }
    return true;
}

/* Does nothing hold, and is nothing due but gaps? */
static bool flies(const Instance *instance, const bool due[]) {
    bool free = due != NULL && !contacts_hold(instance);
    for (int k = 0; k < 2 * N_UNILATERALS + N_FRICTIONS && free; k++) {
        free = !due[k] || (k < 2 * N_UNILATERALS && k % 2 == 0);
    }
    return free;
}

bool contacts_settle(Instance *instance, const bool due[], bool *jumped, bool *again) {
    Settling settling = {.instance = instance};
    const bool flew = flies(instance, due);
    bool collided = false, moved = false;
    if (due == NULL) {
        forget_modes(&instance->state);
    } else {
        memcpy(settling.due, due, (2 * N_UNILATERALS + N_FRICTIONS) * sizeof(bool));
    }
    end_cascades(&settling);
    if (!undo_overlap(&settling, &moved)) {
        return false;
    }
    stop_slips(&settling, &moved);
    if (!settling_stop_in_space(&settling, &moved) || !settling_measure(&settling)) {
        return false;
    }
    if (due == NULL && !starts_apart(&settling)) {
        return false;
    }
    update_latches(&settling);
    find_touching(&settling);
    if (!settling_impacts(&settling, &collided) || !settling_modes(&settling, &moved) ||
        !settling_move(&settling, &moved) ||
        !contacts_oppose(instance, instance->state.time, instance->state.states, NULL)) {
        return false;
    }
    *jumped = *jumped || collided || moved;
    *again = *again || moved || (collided && !(flew && !contacts_hold(instance))); /* in flight impacts decide alone */
    return true;
}
