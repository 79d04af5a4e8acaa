/* Which touching contacts stay closed, and what sticks, as the laws say. */
#include <float.h>
#include <math.h>

#include "accelerations.h"
#include "complementarity.h"
#include "constraints.h"
#include "contact_events.h"
#include "contacts.h"
#include "inputs.h"
#include "least_norm.h"
#include "notices.h"
#include "scale.h"
#include "settings.h"
#include "settling.h"
#include "system.h"

/* Does an open contact close here although it moves apart? It does if its gap is negative by rounding and the motion is
   too slow to make the gap positive. */
static bool stays_near(const Settling *settling, int contact) {
    return settling->due[2 * contact] && !contact_closed(&settling->instance->state, contact);
}

/* The most that the height of a rebound may be in units of the overlap that is undone, so that a contact closes
   instead: up to a restitution of 0.89. With more, a ball would stop in sight. */
static const double MOST_OVERLAPS = 4.0;

/* The height of a rebound, in units of its gap, up to which undoing the overlap brings the energy that an impact takes.
   An importer that locates no events would see lower ones go on without end. */
static double kept_up_rebound(const Settling *settling, int contact) {
    const double e = settling->restitution[contact], taken = 1.0 - e * e;
    return settling->overlap[contact] * (e * e < MOST_OVERLAPS * taken ? e * e / taken : MOST_OVERLAPS);
}

/* Begins the cascade of each contact that has rebounded, or stays near, and will rise less than the tolerance: its
   impacts accumulate. With the velocity v up and the acceleration -a the top is at v/a and the last of the impacts at
   2v/(a(1 - e)). The contact closes at the top, where it is at rest, and is held closed until the last impact: from
   rest to rest the normal impulse is weight times time, and friction takes its part of that.
   A contact that the impact of another one lifts begins a cascade too, as the edges of a rocking block do, which at
   last lift each other without end. If it closed at once, a pull would stop it, and friction would not count the pull.
   Without a restitution of its own it comes down to rest, so that a lift below the tolerance is enough; with one it
   rebounds, and the lift has to be less than is seen. A lift to a gap that counts as closed ends at once: inside the
   hysteresis of an indicator the next impact gains as much speed as the one before.
   Impacts with a restitution of 1 do not accumulate. Such a contact closes at the top of a rebound if its gap is that
   of a closed one all the time: of thousands of impacts a millisecond nothing would be seen. */
static void begin_cascades(Settling *settling) {
    State *state = &settling->instance->state;
    /* The height up to which a lift is not seen: rounding of the gap, or in model exchange the hysteresis of the
       indicator, inside of which each impact is found. A contact that rises less closes at once. */
    const double unseen = settling->instance->policy->integrate ? DBL_EPSILON : 2.0 * HYSTERESIS;
    const double closed = fmax(unseen, AT_REST), lowest_seen = fmin(unseen, AT_REST);
    bool struck = false;
    for (int i = 0; i < N_UNILATERALS; i++) {
        struck = struck || settling->rebounds[i];
    }
    for (int i = 0; i < N_UNILATERALS; i++) {
        const int k = ROW_PLACES[i];
        const double v = settling->velocity[k], a = settling->w[k], e = settling->restitution[i];
        const bool bounces = settling->rebounds[i] || stays_near(settling, i);
        const double least = settling_least_rebound(settling, i);
        const double seen = bounces || e == 0.0 ? least : unseen * row_size(&settling->rows, i);
        const double kept_up = settling->rebounds[i] ? kept_up_rebound(settling, i) : 0.0;
        const double lowest = bounces ? fmax(fmax(seen, kept_up), -settling->rows.positions[i]) : seen;
        const bool lifted = struck && settling->touching[i];
        const bool closes = kept_up > 0.0 && v * v <= -2.0 * a * kept_up;
        const bool seen_rising = bounces || v * v > -2.0 * a * lowest_seen * row_size(&settling->rows, i);
        const bool rises = !closes && seen_rising;
        const double rise = e < 1.0 ? lowest : closed * row_size(&settling->rows, i);
        if ((bounces || lifted) && settling->row[k].law == ROW_FREE && a < 0.0 && v * v <= -2.0 * a * rise) {
            state->cascading[i] = rises ? CASCADE_RISES : CASCADE_RESTS;
            state->states[DISSIPATED] += rises ? 0.0 : 0.5 * v * v / settling->delassus[k * K + k];
            state->top_time[i] = state->time + v / -a;
            state->rest_time[i] = state->time + 2.0 * v / (-a * (e < 1.0 ? 1.0 - e : 1.0));
        }
    }
}

void settling_close(Settling *settling, int contact) {
    State *state = &settling->instance->state;
    const int first = SLIP_ROWS[contact], count = contact_slips(contact);
    double velocity[2] = {0.0};
    for (int i = 0; i < count; i++) {
        velocity[i] = settling->velocity[ROW_PLACES[first + i]];
    }
    if (count > 0 && settling_slip_speed(settling, contact) > settling_least_speed(settling, first)) {
        contact_slide(state, contact, velocity, NO_OUTLOOK);
    } else {
        contact_stick(state, contact);
    }
}

/* Opens a contact, and sets how far below 0 its gap may seem to be, *rest, before that is an event.
   A contact whose force has come down to 0 opens slowly: its gap grows with a high power of the time, or not at all, as
   that of a ball which rolls along a wall. At first the gap is less than what a projection leaves, and than the errors
   of an importer's solver, which starts anew here; *rest is that. The same holds for a contact that rises no higher
   than the importer's errors.
   A contact that an impact lifts opens at once: *rest is no more than the overlap it starts from. With more it would
   fall by the rest each time, and each of its accumulating impacts would be as fast as the one before. */
static void lift_off(Settling *settling, int contact) {
    State *state = &settling->instance->state;
    const bool imported = !settling->instance->policy->integrate;
    double *rest = &state->event_rests[N_SWITCHES + 2 * contact];
    const bool lifted = settling->row[ROW_PLACES[contact]].law == ROW_FREE; /* by an impact: the gap grows at once */
    const bool slowly = contact_closed(state, contact) && !lifted;
    if (slowly || (imported && state->cascading[contact] == CASCADE_RISES)) {
        *rest = fmax(*rest, (imported ? solver_tolerance(state) : AT_REST) * row_size(&settling->rows, contact));
    } else if (lifted && !imported) {
        *rest = fmin(*rest, fmax(-settling->rows.positions[contact], 0.0));
    }
    contact_open(state, contact);
}

/* Has the force of a closed contact come down to 0 here? Its friction comes to its limit at the same time, so that
   either of the two events may be the due one. */
static bool gives_way(const Settling *settling, int contact) {
    const State *state = &settling->instance->state;
    const bool due = settling->due[2 * contact] || settling->due[2 * contact + 1];
    return due && contact_closed(state, contact) && !state->cascading[contact] &&
           !settling_bears(settling, contact, settling->lambda[ROW_PLACES[contact]]);
}

/* Has a contact just opened at this time, so that it stays open although its force is positive by rounding? The force
   of an input that is set at this time may be so, and that of a contact beside which another one opens. */
static bool stays_open(const Settling *settling, int contact) {
    const State *state = &settling->instance->state;
    const bool again = state->due[N_SWITCHES + 2 * contact] || state->events_there > 1;
    const bool given = again && state->event_time >= state->time;
    return given && !contact_closed(state, contact) && !settling->due[2 * contact] &&
           !settling_bears(settling, contact, settling->lambda[ROW_PLACES[contact]]);
}

/* Opens the contact, or closes it, as the laws say. Its first event function changes then from the force to the gap or
   back; what rounding has left of the one is forgotten for the other. */
static void carry_out_contact(Settling *settling, int contact, bool leaves) {
    State *state = &settling->instance->state;
    const int k = ROW_PLACES[contact];
    const bool opens = settling->row[k].law != ROW_UNILATERAL || settling->w[k] > 0.0 || leaves;
    if (opens == contact_closed(state, contact)) {
        state->event_rests[N_SWITCHES + 2 * contact] = 0.0;
    }
    if (opens) {
        lift_off(settling, contact);
    } else {
        settling_carry_out_slip(settling, contact);
    }
}

/* Does this row bear the normal force of a contact that slides by friction? */
static bool presses_what_slides(const Settling *settling, int normal) {
    bool found = false;
    for (int k = 0; k < K; k++) {
        const Row *row = &settling->row[k];
        found = found || (row->law == ROW_SLIDING && row->friction > 0.0 && row->normal == normal);
    }
    return found;
}

/* The rows whose force has no limit: permanent ones, latches, and normals that bear. Returns how many there are. */
static int find_unlimited(const Settling *settling, int rows[]) {
    int count = 0;
    for (int k = 0; k < K; k++) {
        const Row *row = &settling->row[k];
        if (row->law == ROW_BILATERAL || (row->law == ROW_UNILATERAL && settling->lambda[k] > 0.0)) {
            rows[count++] = k;
        }
    }
    return count;
}

/* part[n] of the force of row k that does the same along these rows, as accelerations see it. Returns whether that is
   all that the force does. */
static bool find_parts(const Settling *settling, int k, int n, const int rows[], double part[]) {
    const double *delassus = settling->delassus;
    const ArenaMark mark = arena_mark(settling->instance->arena);
    const size_t bytes = (size_t)n * sizeof(double);
    double rest = delassus[k * K + k];
    if (n == 0 || !arena_reserve(mark.arena, ((size_t)n + 10) * arena_bytes(bytes, 2))) {
        return arena_leave(mark, false);
    }
    double *own = (double *)arena_take(mark.arena, (size_t)n * bytes);
    double *across = (double *)arena_take(mark.arena, bytes);
    for (int i = 0; i < n; i++) {
        across[i] = delassus[rows[i] * K + k];
        for (int j = 0; j < n; j++) {
            own[i * n + j] = delassus[rows[i] * K + rows[j]];
        }
    }
    least_norm_solve(mark.arena, n, own, across, part);
    for (int i = 0; i < n; i++) {
        rest -= part[i] * across[i];
    }
    return arena_leave(mark, rest <= REDUNDANT * delassus[k * K + k]);
}

/* Can rows without a limit bear alone what this friction shares with them, and does the share change what rubs? Then
   they do: the share is arbitrary, would decide on the motion, and would soon be beyond the friction's own limit. */
static bool spared(const Settling *settling, int friction) {
    const ArenaMark mark = arena_mark(settling->instance->arena);
    WORK(mark, int, rows, K);
    WORK(mark, double, part, K);
    const int k = ROW_PLACES[FIRST_FRICTION + friction], n = find_unlimited(settling, rows);
    bool matters = false, bear = find_parts(settling, k, n, rows, part);
    for (int i = 0; i < n && bear; i++) {
        const double own = settling->delassus[rows[i] * K + rows[i]];
        const bool acts = part[i] * part[i] * own > REDUNDANT * settling->delassus[k * K + k];
        matters = matters || (acts && presses_what_slides(settling, rows[i]));
        bear = settling->row[rows[i]].law == ROW_BILATERAL || !acts ||
               settling->lambda[rows[i]] + part[i] * settling->lambda[k] > 0.0;
    }
    return arena_leave(mark, bear && matters);
}

/* A dry friction that cannot hold anything slides, also where something else holds the same motion: a row that sticks
   would share its load, and yield to the first rounding. One that is spared waits until the others let go. */
static void carry_out_friction(Settling *settling, int friction) {
    State *state = &settling->instance->state;
    const int row = FIRST_FRICTION + friction, k = ROW_PLACES[row];
    const bool holds = settling->row[k].law == ROW_BOUNDED && settling->row[k].holding > 0.0;
    const double located = settling_slip_located(settling, row, 2 * N_UNILATERALS + friction);
    const double w = settling->row[k].law == ROW_GIVEN ? located : settling->w[k];
    if (w != 0.0 || !holds) {
        friction_slide(state, friction, w != 0.0 ? w : row_direction(state, row));
    } else if (settling->determined[k] || spared(settling, friction)) {
        friction_wait(state, friction);
    } else {
        friction_stick(state, friction);
    }
}

/* Gives notice if the laws allow another motion than the one that is chosen. */
static void watch_solutions(Settling *settling) {
    const Problem problem = {
        .arena = settling->instance->arena, .rows = K, .delassus = settling->delassus, .free = settling->free,
        .row = settling->row};
    const int row = complementarity_other(&problem);
    for (int i = 0; i < N_UNILATERALS && row >= 0; i++) {
        if (row == ROW_PLACES[i]) {
            give_notice(settling->instance, NOTICE_TWO_SOLUTIONS, 0.0, N_SWITCHES + 2 * i);
        }
    }
}

/* The closed contact that pulls, of those with the multipliers shared[K], and that is the first to bear nothing on the
   way from lambda to them; *part of the way. -1: none pulls. */
static int first_to_pull(const Settling *settling, const double shared[], double *part) {
    const State *state = &settling->instance->state;
    double greatest = 0.0;
    int first = -1;
    for (int k = 0; k < K; k++) {
        greatest = fmax(greatest, fabs(shared[k]));
    }
    for (int i = 0; i < N_UNILATERALS; i++) {
        const double from = fmax(settling->lambda[ROW_PLACES[i]], 0.0), to = shared[ROW_PLACES[i]];
        const bool pulls = contact_closed(state, i) && !state->cascading[i] && to < -OBEYED * greatest;
        if (pulls && (first < 0 || from < *part * (from - to))) {
            *part = from / (from - to);
            first = i;
        }
    }
    return first;
}

/* The contact that sticks farthest beyond its limit with the multipliers shared[K]; -1: none is beyond it. */
static int farthest_beyond(const Settling *settling, const double shared[]) {
    const State *state = &settling->instance->state;
    double most = 0.0;
    int farthest = -1;
    for (int i = 0; i < N_UNILATERALS; i++) {
        const double limit = settling->holding[i] * shared[ROW_PLACES[i]];
        double square = 0.0;
        for (int row = SLIP_ROWS[i]; row < SLIP_ROWS[i + 1]; row++) {
            square += shared[ROW_PLACES[row]] * shared[ROW_PLACES[row]];
        }
        const double beyond = sqrt(square) - (1.0 + YIELDS) * limit;
        const bool holds = contact_closed(state, i) && contact_sticks(state, i);
        if (holds && beyond > most && settling_bears(settling, i, beyond)) {
            most = beyond;
            farthest = i;
        }
    }
    return farthest;
}

bool settling_relieve(Settling *settling) {
    const ArenaMark mark = arena_mark(settling->instance->arena);
    WORK(mark, double, unknowns, N_UNKNOWNS);
    Instance *instance = settling->instance;
    const State *state = &instance->state;
    double part = 0.0;
    for (int round = 0; round < 2 * N_UNILATERALS && contacts_sliding(instance); round++) {
        if (!accelerations_at(instance, state->time, state->states, inputs_at(instance, state->time), unknowns)) {
            return arena_leave(mark, false);
        }
        if (multipliers_unique(instance)) {
            break;
        }
        contacts_share(instance, &instance->scratch.system, unknowns);
        const double *shared = unknowns + N_COORDINATES;
        const int pulls = first_to_pull(settling, shared, &part), slips = farthest_beyond(settling, shared);
        if (pulls < 0 && slips < 0) {
            break;
        }
        if (pulls >= 0) {
            for (int k = 0; k < K; k++) {
                settling->lambda[k] += part * (shared[k] - settling->lambda[k]);
            }
            lift_off(settling, pulls);
        } else {
            settling_give_way(settling, slips, shared);
        }
        if (!constraints_regroup(instance)) {
            return arena_leave(mark, false);
        }
    }
    return arena_leave(mark, true);
}

/* Is a force so great that its contact has hardly a lever? The next smooth motion would begin beside a pole. */
static bool lacks_lever(const Settling *settling) {
    double greatest = 0.0;
    bool lacks = false;
    for (int k = 0; k < K; k++) {
        greatest = fmax(greatest, fabs(settling->free[k]));
    }
    for (int i = 0; i < N_UNILATERALS; i++) {
        const int k = ROW_PLACES[i];
        lacks = lacks || LOCATED * settling->delassus[k * K + k] * settling->lambda[k] > greatest;
    }
    return lacks;
}

/* Solves the laws. Where there are no forces, or they have no bound, an impact comes before that stops the slip. Steps
   end some way before the pole of a force, so that its contact still has a lever there. */
static bool solve_or_jam(Settling *settling, bool *jumped) {
    State *state = &settling->instance->state;
    const bool at_pole = state->jams != 0;
    bool solved = settling_laws(settling);
    state->jams = 0;
    if ((!solved || at_pole || lacks_lever(settling)) &&
        settling_without_collision(settling, at_pole ? LOCATED_LOOSELY : LOCATED, jumped)) {
        solved = settling_laws(settling);
    }
    return solved;
}

bool settling_modes(Settling *settling, bool *jumped) {
    const ArenaMark mark = arena_mark(settling->instance->arena);
    WORK(mark, bool, leaves, SIZE_UNILATERALS);
    Instance *instance = settling->instance;
    if (!solve_or_jam(settling, jumped)) {
        return arena_leave(mark, settling_fail(instance));
    }
    watch_solutions(settling);
    begin_cascades(settling);
    for (int i = 0; i < N_UNILATERALS; i++) {
        leaves[i] = gives_way(settling, i) || stays_open(settling, i);
    }
    for (int i = 0; i < N_UNILATERALS; i++) {
        const int64_t cascade = instance->state.cascading[i];
        if (cascade == CASCADE_RESTS && settling->row[ROW_PLACES[i]].law == ROW_FREE) {
            settling_close(settling, i);
            continue;
        }
        carry_out_contact(settling, i, leaves[i]);
        if (cascade == CASCADE_RISES && !contact_closed(&instance->state, i)) {
            instance->state.cascading[i] = cascade;
        }
    }
    for (int i = 0; i < N_FRICTIONS; i++) {
        carry_out_friction(settling, i);
    }
    return arena_leave(mark, true);
}
