/* Which touching contacts stay closed, and what sticks, as the laws say. */
#include <float.h>
#include <math.h>

#include "complementarity.h"
#include "notices.h"
#include "scale.h"
#include "settings.h"
#include "settling.h"

/* Does an open contact close here although it moves apart? It does if its gap is negative by rounding and the motion is
   too slow to make the gap positive. */
static bool stays_near(const Settling *settling, int contact) {
    return settling->due[2 * contact] && !contact_closed(&settling->instance->state, contact);
}

/* Impacts of these contacts, which have just rebounded or stay near, accumulate: what is left of them is lower than the
   tolerance. They close at the top of this rebound, where they are at rest, and stay so as long as the other impacts
   would last: from rest to rest the normal impulse is weight times time, and friction takes its part of that. So do
   contacts that the impact of another one lifts less than is seen, as the edges of a rocking block at last lift each
   other without end: closed at once they would be pulled back, and friction does not know of a pull. */
static void begin_cascades(Settling *settling) {
    State *state = &settling->instance->state;
    /* A gap that opens no more than its rounding is not seen to open, and closes at once. In model exchange each impact
       is found inside by the hysteresis of its indicator: a lift of that height is not seen there. */
    const double unseen = settling->instance->policy->integrate ? DBL_EPSILON : 2.0 * HYSTERESIS;
    bool struck = false;
    for (int i = 0; i < N_UNILATERALS; i++) {
        struck = struck || settling->rebounds[i];
    }
    for (int i = 0; i < N_UNILATERALS; i++) {
        const int k = ROW_PLACES[i];
        const double v = settling->velocity[k], a = settling->w[k], e = settling->restitution[i];
        const bool bounces = settling->rebounds[i] || stays_near(settling, i);
        const double seen = bounces ? settling_least_rebound(settling, i) : unseen * row_size(&settling->rows, i);
        const double lowest = bounces ? fmax(seen, -settling->rows.positions[i]) : seen;
        const bool lifted = struck && settling->touching[i];
        const bool rises = bounces || v * v > -2.0 * a * DBL_EPSILON * row_size(&settling->rows, i);
        if ((bounces || lifted) && settling->row[k].law == ROW_FREE && a < 0.0 && e < 1.0 &&
            v * v <= -2.0 * a * lowest) {
            state->cascading[i] = rises ? CASCADE_RISES : CASCADE_RESTS;
            state->states[DISSIPATED] += rises ? 0.0 : 0.5 * v * v / settling->delassus[k * K + k];
            state->top_time[i] = state->time + v / -a;
            state->rest_time[i] = state->time + 2.0 * v / (-a * (1.0 - e));
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
        contact_slide(state, contact, velocity, 0.0);
    } else {
        contact_stick(state, contact);
    }
}

/* A contact that has come to bear nothing opens. Its gap grows with a high power of the time at first, or not at all,
   as that of a ball which rolls along a wall: slower than what a projection leaves of a gap, and than the errors of an
   importer's solver, which starts anew here. Its event function begins so far above 0. So does that of a contact which
   rises no higher than the importer's errors. One that an impact lifts needs no more than what it begins below 0: what
   it fell beyond that would make each of its accumulating impacts as fast as the one before. */
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

/* Has the force of a closed contact come down to 0 here? Its friction then comes to its limit together with it. */
static bool gives_way(const Settling *settling, int contact) {
    const State *state = &settling->instance->state;
    const bool due = settling->due[2 * contact] || settling->due[2 * contact + 1];
    return due && contact_closed(state, contact) && !state->cascading[contact] &&
           !settling_bears(settling, contact, settling->lambda[ROW_PLACES[contact]]);
}

/* A contact that has just given way does not close again for a force that is rounding, as that of an input which is set
   at this time. */
static bool stays_open(const Settling *settling, int contact) {
    const State *state = &settling->instance->state;
    const bool given = state->due[N_SWITCHES + 2 * contact] && state->event_time >= state->time;
    return given && !contact_closed(state, contact) && !settling->due[2 * contact] &&
           !settling_bears(settling, contact, settling->lambda[ROW_PLACES[contact]]);
}

/* Where a contact opens or closes, its first event function becomes another one: the gap instead of the force, or the
   force instead of the gap. What was left of the one is no rounding of the other. */
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

/* A dry friction that cannot hold anything slides, also where something else holds the same motion: a row that sticks
   would share its load, and yield to the first rounding. */
static void carry_out_friction(Settling *settling, int friction) {
    State *state = &settling->instance->state;
    const int row = FIRST_FRICTION + friction, k = ROW_PLACES[row];
    const bool holds = settling->row[k].law == ROW_BOUNDED && settling->row[k].holding > 0.0;
    const double located = settling_slip_located(settling, row, 2 * N_UNILATERALS + friction);
    const double w = settling->row[k].law == ROW_GIVEN ? located : settling->w[k];
    if (w != 0.0 || !holds) {
        friction_slide(state, friction, w != 0.0 ? w : row_direction(state, row));
    } else if (settling->determined[k]) {
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

bool settling_modes(Settling *settling, bool *jumped) {
    const ArenaMark mark = arena_mark(settling->instance->arena);
    WORK(mark, bool, leaves, SIZE_UNILATERALS);
    Instance *instance = settling->instance;
    const bool solved =
        settling_laws(settling) || (settling_without_collision(settling, jumped) && settling_laws(settling));
    if (!solved) {
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
