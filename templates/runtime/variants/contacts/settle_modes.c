/* Which touching contacts stay closed, and what sticks: complementarity of forces and accelerations. Forces of dry
   friction may depend on what other rows bear; they are found by repetition. */
#include <math.h>
#include <string.h>

#include "complementarity.h"
#include "inputs.h"
#include "notices.h"
#include "repetition.h"
#include "settings.h"
#include "settling.h"
#include "stopping_slips.h"

enum { N = N_COORDINATES, K = N_CONSTRAINTS, MOST_REPETITIONS = 200, FEW_REPETITIONS = 50 };

/* A contact or dry friction that is due to slide holds less than its limit by this part, which is more than the laws
   count as rounding. */
static const double GIVES_WAY = 1e-6;

/* A gap that opens to this part of nominal values, no more than its rounding, is not seen to open. In model exchange
   each impact is found inside by the hysteresis of its indicator, and this fall lifts the next one again: what opens to
   ten times the hysteresis is not seen there. */
static const double UNSEEN = 1e-16, UNSEEN_LOOSELY = 1e-8;

static void set_slips(Settling *settling, int contact) {
    const State *state = &settling->instance->state;
    const int first = SLIP_ROWS[contact], end = SLIP_ROWS[contact + 1];
    const double speed = settling_slip_speed(settling, contact), mu = settling->friction[contact];
    const bool rests = end > first && speed <= settling_least_speed(settling, first);
    const bool yields = contact_sticks(state, contact) && settling_due(settling, 2 * contact + 1);
    for (int row = first; row < end; row++) {
        const double along = rests ? 0.0 : settling_slip_velocity(settling, contact, row) / speed;
        settling->row[ROW_PLACES[row]] = (Row){.law = rests ? ROW_TANGENTIAL : ROW_SLIDING,
                                               .normal = ROW_PLACES[contact],
                                               .friction = yields ? mu * (1.0 - GIVES_WAY) : mu,
                                               .holding = yields ? mu * (1.0 - GIVES_WAY)
                                                                 : fmax(mu, settling->holding[contact]),
                                               .value = along,
                                               .holds = contact_sticks(state, contact) && !yields};
    }
}

static void set_contact(Settling *settling, int contact) {
    const State *state = &settling->instance->state;
    const int k = ROW_PLACES[contact];
    const bool rests = settling->touching[contact] &&
                       (state->cascading[contact] || settling->velocity[k] <= settling_least_speed(settling, contact));
    settling->row[k] = (Row){.law = rests ? ROW_UNILATERAL : ROW_FREE, .holds = contact_closed(state, contact)};
    for (int row = SLIP_ROWS[contact]; row < SLIP_ROWS[contact + 1]; row++) {
        settling->row[ROW_PLACES[row]] = (Row){.law = ROW_FREE};
    }
    if (rests) {
        set_slips(settling, contact);
    }
}

static void set_friction(Settling *settling, int friction, double force, double capacity) {
    const State *state = &settling->instance->state;
    const int row = FIRST_FRICTION + friction, k = ROW_PLACES[row];
    const double w = slip_located(settling, row, 2 * N_UNILATERALS + friction);
    const bool yields = friction_sticks(state, friction) && settling_due(settling, 2 * N_UNILATERALS + friction);
    if (fabs(w) <= settling_least_speed(settling, row)) {
        const double least = force * (1.0 - GIVES_WAY);
        settling->row[k] = (Row){.law = ROW_BOUNDED,
                                 .friction = yields ? least : force,
                                 .holding = yields ? least : fmax(force, capacity),
                                 .holds = friction_sticks(state, friction) && !yields};
    } else {
        settling->row[k] = (Row){.law = ROW_GIVEN, .value = w > 0.0 ? -force : force};
    }
}

static void set_rows(Settling *settling, const double force[], const double capacity[]) {
    const State *state = &settling->instance->state;
    for (int k = 0; k < K; k++) {
        settling->row[k] = (Row){.law = ROW_BILATERAL};
    }
    for (int i = 0; i < N_UNILATERALS; i++) {
        set_contact(settling, i);
    }
    for (int i = 0; i < N_FRICTIONS; i++) {
        set_friction(settling, i, force[i], capacity[i]);
    }
    for (int row = FIRST_LATCH; row < N_ROWS; row++) {
        settling->row[ROW_PLACES[row]].law = row_active(state, row) ? ROW_BILATERAL : ROW_FREE;
    }
}

/* lambda and w of all rows. Returns false if there are none. */
static bool solve_laws(Settling *settling) {
    const State *state = &settling->instance->state;
    const Problem problem = {K, settling->delassus, settling->free, settling->row};
    double unknowns[N_UNKNOWNS] = {0.0};
    double sliding[SIZE_FRICTIONAL], force[SIZE_FRICTIONS] = {0.0}, capacity[SIZE_FRICTIONS] = {0.0};
    Repetition last;
    memset(&last, 0, sizeof last);
    for (int i = 0; i < MOST_REPETITIONS; i++) {
        double change = 0.0, greatest = 0.0;
        mechanism_friction(state->time, state->states, inputs_at(settling->instance, state->time), state->parameters,
                           unknowns, sliding, force, capacity);
        set_rows(settling, force, capacity);
        if (!complementarity_solve(&problem, settling->lambda, settling->w)) {
            return false;
        }
        for (int k = 0; k < K; k++) {
            change = fmax(change, fabs(settling->lambda[k] - unknowns[N + k]));
            greatest = fmax(greatest, fabs(settling->lambda[k]));
        }
        repetition_proceed(&last, settling->lambda, i > FEW_REPETITIONS, unknowns + N);
        if (change <= 1e-13 * greatest || N_FRICTIONS == 0) {
            return true;
        }
    }
    return false;
}

/* Does an open contact close here although it moves apart? It does if its gap is negative by rounding and the motion is
   too slow to make the gap positive. */
static bool stays_near(const Settling *settling, int contact) {
    return settling_due(settling, 2 * contact) && !contact_closed(&settling->instance->state, contact);
}

/* Impacts of these contacts, which have just rebounded or stay near, accumulate: what is left of them is lower than the
   tolerance. So do those of contacts that the impact of another one lifts less than is seen, as the edges of a rocking
   block at last lift each other without end. They close, and stay in this state as long as the rest of the impacts
   lasts. */
static void begin_cascades(Settling *settling) {
    State *state = &settling->instance->state;
    const double unseen = settling->instance->policy->stabilise ? UNSEEN_LOOSELY : UNSEEN;
    bool struck = false;
    for (int i = 0; i < N_UNILATERALS; i++) {
        struck = struck || settling->rebounds[i];
    }
    for (int i = 0; i < N_UNILATERALS; i++) {
        const int k = ROW_PLACES[i];
        const double v = settling->velocity[k], a = settling->w[k], e = settling->restitution[i];
        const bool bounces = settling->rebounds[i] || stays_near(settling, i);
        const double seen = (bounces ? solver_tolerance(state) : unseen) * row_size(&settling->rows, i);
        const double lowest = bounces ? fmax(seen, -settling->rows.positions[i]) : seen;
        const bool lifted = struck && settling->touching[i];
        if ((bounces || lifted) && settling->row[k].law == ROW_FREE && a < 0.0 && e < 1.0 &&
            v * v <= -2.0 * a * lowest) {
            state->cascading[i] = 1;
            state->states[DISSIPATED] += 0.5 * v * v / settling->delassus[k * K + k];
            state->rest_time[i] = state->time + 2.0 * v / (-a * (1.0 - e));
        }
    }
}

/* A contact whose impacts accumulate closes as it moves. Its velocity vanishes when the states are moved onto the rows;
   then forces are found once more, because those of the motion before may not keep all contacts of a body closed. */
static void close_cascade(Settling *settling, int contact) {
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

/* A contact that has come to bear nothing opens. Its gap grows with a high power of the time at first, slower than the
   errors of an importer's solver, which starts anew here: its event indicator begins so far above 0. */
static void lift_off(Settling *settling, int contact) {
    State *state = &settling->instance->state;
    double *rest = &state->event_rests[N_SWITCHES + 2 * contact];
    const bool lifted = settling->row[ROW_PLACES[contact]].law == ROW_FREE; /* by an impact: the gap grows at once */
    if (settling->instance->policy->stabilise && contact_closed(state, contact) && !lifted) {
        *rest = fmax(*rest, solver_tolerance(state) * row_size(&settling->rows, contact));
    }
    contact_open(state, contact);
}

/* Has the force of a closed contact come down to 0 here? */
static bool gives_way(const Settling *settling, int contact) {
    const State *state = &settling->instance->state;
    return settling_due(settling, 2 * contact) && contact_closed(state, contact) && !state->cascading[contact] &&
           !settling_bears(settling, contact, settling->lambda[ROW_PLACES[contact]]);
}

/* Where a contact gives way, or has just done so, one that is open does not close for a force that is rounding. Else
   the contacts of a body that leaves its support at once would take turns in being the last one, and one would close
   again for the rounding of an input that is set at this time. */
static bool follows(const Settling *settling, int contact) {
    const State *state = &settling->instance->state;
    bool given = state->due[N_SWITCHES + 2 * contact] && state->event_time >= state->time;
    for (int i = 0; i < N_UNILATERALS; i++) {
        given = given || (i != contact && gives_way(settling, i));
    }
    return given && !contact_closed(state, contact) && !settling_due(settling, 2 * contact) &&
           !settling_bears(settling, contact, settling->lambda[ROW_PLACES[contact]]);
}

static void carry_out_contact(Settling *settling, int contact, bool leaves) {
    const int k = ROW_PLACES[contact];
    if (settling->row[k].law != ROW_UNILATERAL || settling->w[k] > 0.0 || leaves) {
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
    const double w = settling->row[k].law == ROW_GIVEN ? slip_located(settling, row, 2 * N_UNILATERALS + friction)
                                                       : settling->w[k];
    if (w != 0.0 || !holds) {
        friction_slide(state, friction, w != 0.0 ? w : row_direction(state, row));
    } else {
        friction_stick(state, friction);
    }
}

/* Gives notice if the laws allow another motion than the one that is chosen. */
static void watch_solutions(Settling *settling) {
    const Problem problem = {K, settling->delassus, settling->free, settling->row};
    const int row = complementarity_other(&problem);
    for (int i = 0; i < N_UNILATERALS && row >= 0; i++) {
        if (row == ROW_PLACES[i]) {
            note_impact(settling->instance, NOTICE_TWO_SOLUTIONS, N_SWITCHES + 2 * i);
        }
    }
}

bool settling_modes(Settling *settling, bool *jumped) {
    Instance *instance = settling->instance;
    bool solved = solve_laws(settling) || (settling_without_collision(settling, jumped) && solve_laws(settling));
    if (!solved) {
        instance->failure.kind = FAILURE_MODES;
        instance->failure.time = instance->state.time;
        return false;
    }
    watch_solutions(settling);
    begin_cascades(settling);
    bool leaves[SIZE_UNILATERALS];
    for (int i = 0; i < N_UNILATERALS; i++) {
        leaves[i] = gives_way(settling, i) || follows(settling, i);
    }
    for (int i = 0; i < N_UNILATERALS; i++) {
        if (instance->state.cascading[i] && settling->row[ROW_PLACES[i]].law == ROW_FREE) {
            close_cascade(settling, i);
        } else {
            carry_out_contact(settling, i, leaves[i]);
        }
    }
    for (int i = 0; i < N_FRICTIONS; i++) {
        carry_out_friction(settling, i);
    }
    return true;
}
