/* Which touching contacts stay closed, and what sticks: complementarity of forces and accelerations. Forces of dry
   friction may depend on what other rows bear; they are found by repetition. */
#include <math.h>
#include <string.h>

#include "complementarity.h"
#include "inputs.h"
#include "notices.h"
#include "settings.h"
#include "settling.h"

enum { N = N_COORDINATES, K = N_CONSTRAINTS, MOST_REPETITIONS = 200 };

/* Errors leave a slip in space that comes to rest with up to 10 tolerances of the greatest velocity. This is so many
   tolerances in units of a velocity that is as good as 0. */
static const double LOOSE = 1e11;

/* A contact or dry friction that is due to slide holds less than its limit by this part, which is more than the laws
   count as rounding. */
static const double GIVES_WAY = 1e-6;

/* A gap that opens to this part of nominal values, no more than its rounding, is not seen to open. */
static const double UNSEEN = 1e-16;

static double slip_speed(const Settling *settling, int contact) {
    double speed = 0.0;
    for (int row = SLIP_ROWS[contact]; row < SLIP_ROWS[contact + 1]; row++) {
        speed = hypot(speed, settling->velocity[ROW_PLACES[row]]);
    }
    return speed;
}

static double loose_speed(const Settling *settling, int contact) {
    const double least = settling_least_speed(settling, SLIP_ROWS[contact]);
    return least * (1.0 + LOOSE * solver_tolerance(&settling->instance->state));
}

/* In space a slip whose event is due has turned away from the direction that it began with. It may be at rest or not,
   and is located less sharply than one along a line. */
static bool comes_to_rest(const Settling *settling, int contact) {
    const bool in_space = SLIP_ROWS[contact + 1] - SLIP_ROWS[contact] == 2;
    return in_space && settling_due(settling, 2 * contact + 1) &&
           !contact_sticks(&settling->instance->state, contact) &&
           slip_speed(settling, contact) <= loose_speed(settling, contact);
}

/* Slips of several contacts of a body end together: none is located more sharply than the one that is due. */
static bool slips_at_rest(const Settling *settling, int contact) {
    const double speed = slip_speed(settling, contact);
    bool rests = speed <= settling_least_speed(settling, SLIP_ROWS[contact]);
    for (int i = 0; i < N_UNILATERALS && !rests && speed <= loose_speed(settling, contact); i++) {
        rests = comes_to_rest(settling, i);
    }
    return rests;
}

static void set_slips(Settling *settling, int contact) {
    const State *state = &settling->instance->state;
    const int first = SLIP_ROWS[contact], end = SLIP_ROWS[contact + 1];
    const bool rests = end > first && slips_at_rest(settling, contact);
    const bool yields = contact_sticks(state, contact) && settling_due(settling, 2 * contact + 1);
    const double speed = slip_speed(settling, contact), mu = settling->friction[contact];
    for (int row = first; row < end; row++) {
        const double along = rests ? 0.0 : settling->velocity[ROW_PLACES[row]] / speed;
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
    const double w = settling->velocity[k];
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
        memcpy(unknowns + N, settling->lambda, sizeof settling->lambda);
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
   lasts. Returns whether there are any. */
static bool begin_cascades(Settling *settling) {
    State *state = &settling->instance->state;
    bool found = false, struck = false;
    for (int i = 0; i < N_UNILATERALS; i++) {
        struck = struck || settling->rebounds[i];
    }
    for (int i = 0; i < N_UNILATERALS; i++) {
        const int k = ROW_PLACES[i];
        const double v = settling->velocity[k], a = settling->w[k], e = settling->restitution[i];
        const bool bounces = settling->rebounds[i] || stays_near(settling, i);
        const double lowest = (bounces ? solver_tolerance(state) : UNSEEN) * row_size(&settling->rows, i);
        const bool lifted = struck && settling->touching[i];
        if ((bounces || lifted) && settling->row[k].law == ROW_FREE && a < 0.0 && e < 1.0 &&
            v * v <= -2.0 * a * lowest) {
            state->cascading[i] = 1;
            state->states[DISSIPATED] += 0.5 * v * v / settling->delassus[k * K + k];
            state->rest_time[i] = state->time + 2.0 * v / (-a * (1.0 - e));
            found = true;
        }
    }
    return found;
}

/* A contact that has come to bear nothing opens. Its gap grows with a high power of the time at first, slower than the
   errors of an importer's solver, which starts anew here: its event indicator begins so far above 0. */
static void lift_off(Settling *settling, int contact) {
    State *state = &settling->instance->state;
    double *rest = &state->event_rests[N_SWITCHES + 2 * contact];
    if (settling->instance->policy->stabilise && contact_closed(state, contact) && !settling->rebounds[contact]) {
        *rest = fmax(*rest, solver_tolerance(state) * row_size(&settling->rows, contact));
    }
    contact_open(state, contact);
}

/* Does a contact in space slip, though it may be counted as at rest? */
static bool turns(const Settling *settling, int contact) {
    const int first = SLIP_ROWS[contact];
    return SLIP_ROWS[contact + 1] - first == 2 &&
           slip_speed(settling, contact) > settling_least_speed(settling, first);
}

/* What a row of slip begins to do, its contact being closed. A slip in space has a direction by its velocity as long as
   it has one. One that begins does so against the friction, as Coulomb's law says: where w is small the friction tells
   the direction better. */
static double slip_begins(const Settling *settling, int contact, int row) {
    const int place = ROW_PLACES[row], first = SLIP_ROWS[contact], last = SLIP_ROWS[contact + 1] - 1;
    const double x = settling->lambda[ROW_PLACES[first]], y = settling->lambda[ROW_PLACES[last]];
    if (settling->row[place].law == ROW_SLIDING || turns(settling, contact)) {
        return settling->velocity[place];
    }
    return first < last && (x != 0.0 || y != 0.0) ? -settling->lambda[place] : settling->w[place];
}

/* Does the contact slip, or begin to? */
static bool slips(const Settling *settling, int contact) {
    bool found = false;
    for (int row = SLIP_ROWS[contact]; row < SLIP_ROWS[contact + 1]; row++) {
        const int place = ROW_PLACES[row];
        found = found || settling->row[place].law == ROW_SLIDING || settling->w[place] != 0.0;
    }
    return found;
}

static void carry_out_contact(Settling *settling, int contact) {
    State *state = &settling->instance->state;
    const int k = ROW_PLACES[contact], first = SLIP_ROWS[contact];
    const double lambda = settling->lambda[k];
    const bool gives_way = settling_due(settling, 2 * contact) && contact_closed(state, contact) &&
                           !state->cascading[contact] && !settling_bears(settling, contact, lambda);
    double begins[2] = {0.0};
    if (settling->row[k].law != ROW_UNILATERAL || settling->w[k] > 0.0 || gives_way) {
        lift_off(settling, contact);
        return;
    }
    for (int i = 0; i < SLIP_ROWS[contact + 1] - first; i++) {
        begins[i] = slip_begins(settling, contact, first + i);
    }
    if (slips(settling, contact)) {
        contact_slide(state, contact, begins);
        if (turns(settling, contact)) { /* the speed along a new direction is another function */
            state->event_rests[N_SWITCHES + 2 * contact + 1] = 0.0;
        }
    } else {
        contact_stick(state, contact);
    }
}

static void carry_out_friction(Settling *settling, int friction) {
    State *state = &settling->instance->state;
    const int k = ROW_PLACES[FIRST_FRICTION + friction];
    const double w = settling->row[k].law == ROW_GIVEN ? settling->velocity[k] : settling->w[k];
    if (w != 0.0) {
        friction_slide(state, friction, w);
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
    if (solved && begin_cascades(settling)) {
        solved = solve_laws(settling);
    }
    if (!solved) {
        instance->failure.kind = FAILURE_MODES;
        instance->failure.time = instance->state.time;
        return false;
    }
    watch_solutions(settling);
    for (int i = 0; i < N_UNILATERALS; i++) {
        carry_out_contact(settling, i);
    }
    for (int i = 0; i < N_FRICTIONS; i++) {
        carry_out_friction(settling, i);
    }
    return true;
}
