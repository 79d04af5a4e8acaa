/* Which forces obey the laws at the measured point: complementarity of forces and accelerations. Forces of dry friction
   may depend on what other rows bear; they are found by repetition. */
#include <math.h>
#include <string.h>

#include "complementarity.h"
#include "inputs.h"
#include "scale.h"
#include "settings.h"
#include "settling.h"

/* Repetitions for the loads that dry frictions depend on: the most, and the number after which they count as slow. */
enum { MOST_REPETITIONS = 200, FEW_REPETITIONS = 50 };

/* Is the row one along which no force has a lever, and its slip fast enough to have a direction? */
static bool moves_without_lever(const Settling *settling, int row) {
    const int k = ROW_PLACES[row];
    return settling->determined[k] && fabs(settling->velocity[k]) > 0.5 * WAITING_SLIP;
}

static void set_slips(Settling *settling, int contact) {
    const State *state = &settling->instance->state;
    const int first = SLIP_ROWS[contact], end = SLIP_ROWS[contact + 1];
    const double speed = settling_slip_speed(settling, contact), mu = settling->friction[contact];
    double along[2] = {0.0};
    const double holding = fmax(mu, settling->holding[contact]);
    const bool stops = settling->stopping[2 * contact + 1];
    const bool rests = end > first && (stops || (speed <= settling_least_speed(settling, first) &&
                                                 !moves_without_lever(settling, first)));
    const bool yields = contact_sticks(state, contact) ? settling->due[2 * contact + 1] : settling->only_switched;
    if (!rests) {
        settling_slip_direction(settling, contact, along);
    }
    const double length = hypot(along[0], along[1]);
    for (int row = first; row < end; row++) {
        settling->row[ROW_PLACES[row]] = (Row){.law = rests ? ROW_TANGENTIAL : ROW_SLIDING,
                                               .normal = ROW_PLACES[contact],
                                               .friction = yields ? mu * (1.0 - YIELDS) : mu,
                                               .holding = holding * (yields ? 1.0 - YIELDS : 1.0),
                                               .value = rests ? 0.0 : along[row - first] / length,
                                               .holds = stops || (contact_sticks(state, contact) && !yields),
                                               .slid = !contact_sticks(state, contact)};
    }
}

/* An impact that has brought a contact to rest, its slips too, has pressed it: of several solutions the one goes on in
   which it bears and sticks. A body that an impact has wedged in stays, though no force presses it there. */
static void hold_caught(Settling *settling, int contact) {
    const int first = SLIP_ROWS[contact], end = SLIP_ROWS[contact + 1];
    const bool caught = settling->rebounds[contact] && end > first &&
                        settling->row[ROW_PLACES[first]].law == ROW_TANGENTIAL;
    for (int row = first; row < end && caught; row++) {
        settling->row[ROW_PLACES[row]].holds = settling->row[ROW_PLACES[contact]].holds = true;
    }
}

static void set_settled_contact(Settling *settling, int contact) {
    const State *state = &settling->instance->state;
    const int k = ROW_PLACES[contact];
    const bool rests = settling->touching[contact] &&
                       (state->cascading[contact] == CASCADE_RESTS ||
                        settling->velocity[k] <= settling_least_speed(settling, contact));
    settling->row[k] = (Row){.law = rests ? ROW_UNILATERAL : ROW_FREE, .holds = contact_closed(state, contact)};
    for (int row = SLIP_ROWS[contact]; row < SLIP_ROWS[contact + 1]; row++) {
        settling->row[ROW_PLACES[row]] = (Row){.law = ROW_FREE};
    }
    if (rests) {
        set_slips(settling, contact);
        hold_caught(settling, contact);
    }
}

static void set_settled_friction(Settling *settling, int friction, double force, double capacity, double greatest) {
    const State *state = &settling->instance->state;
    const int row = FIRST_FRICTION + friction, k = ROW_PLACES[row];
    const double w = settling_slip_located(settling, row, 2 * N_UNILATERALS + friction);
    const bool due = settling->due[2 * N_UNILATERALS + friction];
    const bool yields = friction_sticks(state, friction) ? due : settling->only_switched;
    const bool stops = settling->stopping[2 * N_UNILATERALS + friction];
    if (stops || (fabs(w) <= settling_least_speed(settling, row) && !moves_without_lever(settling, row))) {
        const double less = yields ? YIELDS * greatest : 0.0;
        settling->row[k] = (Row){.law = ROW_BOUNDED,
                                 .friction = fmax(force - less, 0.0),
                                 .holding = fmax(fmax(force, capacity) - less, 0.0),
                                 .holds = stops || (friction_sticks(state, friction) && !yields),
                                 .slid = !friction_sticks(state, friction)};
    } else {
        settling->row[k] = (Row){.law = ROW_GIVEN, .value = w > 0.0 ? -force : force};
    }
}

static void set_rows(Settling *settling, const double force[], const double capacity[]) {
    const State *state = &settling->instance->state;
    double greatest = 0.0;
    for (int k = 0; k < K; k++) {
        settling->row[k] = (Row){.law = ROW_BILATERAL};
    }
    for (int i = 0; i < N_UNILATERALS; i++) {
        set_settled_contact(settling, i);
    }
    for (int i = 0; i < N_FRICTIONS; i++) {
        greatest = fmax(greatest, force[i]);
    }
    for (int i = 0; i < N_FRICTIONS; i++) {
        set_settled_friction(settling, i, force[i], capacity[i], greatest);
    }
    for (int row = FIRST_LATCH; row < N_ROWS; row++) {
        settling->row[ROW_PLACES[row]].law = row_active(state, row) ? ROW_BILATERAL : ROW_FREE;
    }
}

/* Is there a row at rest without a lever whose slip has become too fast to wait for one? */
static bool any_moves_without_lever(const Settling *settling) {
    bool found = false;
    for (int row = FIRST_SLIP; row < FIRST_LATCH; row++) {
        const RowLaw law = settling->row[ROW_PLACES[row]].law;
        found = found || ((law == ROW_BOUNDED || law == ROW_TANGENTIAL) && moves_without_lever(settling, row));
    }
    return found;
}

/* The last repetition of laws and loads: the multipliers that it began with, and by how much those found differed. */
typedef struct {
    double x[K], rest[K];
} Repetition;

/* Sets x[K], for which the laws have found the multipliers answer[K], to what the next repetition begins with. That is
   the answer, or, where repetitions are slow, what the last two of them lead to along a line. *last begins with zeros.
   D. G. Anderson, Iterative procedures for nonlinear integral equations, Journal of the ACM 12, 1965. */
static void proceed(Repetition *last, const double answer[], bool slow, double x[]) {
    double square = 0.0, product = 0.0;
    for (int k = 0; k < K; k++) {
        const double rest = answer[k] - x[k], change = rest - last->rest[k];
        square += change * change;
        product += change * rest;
    }
    const double part = slow && square > 0.0 ? product / square : 0.0;
    for (int k = 0; k < K; k++) {
        const double before = last->x[k] + last->rest[k];
        last->x[k] = x[k];
        last->rest[k] = answer[k] - x[k];
        x[k] = answer[k] - part * (answer[k] - before);
    }
}

/* What dry frictions bear while they slide, and at most. Neither is used where there are none. */
typedef struct {
    double force[SIZE_FRICTIONS], capacity[SIZE_FRICTIONS];
} Limits;

/* The limits where the rows bear multipliers[K]. */
static void friction_limits(const Settling *settling, const double multipliers[], Limits *limits) {
    const ArenaMark mark = arena_mark(settling->instance->arena);
    WORK_ZEROS(mark, double, unknowns, N_UNKNOWNS);
    WORK(mark, double, sliding, SIZE_FRICTIONAL);
    const State *state = &settling->instance->state;
    memcpy(unknowns + N, multipliers, K * sizeof(double));
    memset(limits, 0, sizeof *limits);
    mechanism_friction(state->time, state->states, inputs_at(settling->instance, state->time), state->parameters,
                       unknowns, sliding, limits->force, limits->capacity);
    arena_release(mark);
}

/* Do the forces that were found leave these limits, for which they were found, as they are? Loads that several rows
   share in many ways are told to less than that; where no limit depends on the share, it may be any. */
static bool limits_stay(const Settling *settling, const Limits *limits) {
    const ArenaMark mark = arena_mark(settling->instance->arena);
    WORK_OF(mark, Limits, found);
    double change = 0.0, greatest = 0.0;
    friction_limits(settling, settling->lambda, found);
    for (int i = 0; i < N_FRICTIONS; i++) {
        change = fmax(change, fabs(found->force[i] - limits->force[i]));
        change = fmax(change, fabs(found->capacity[i] - limits->capacity[i]));
    }
    for (int k = 0; k < K; k++) {
        greatest = fmax(greatest, fabs(settling->lambda[k]));
    }
    return arena_leave(mark, change <= SOLVED * greatest);
}

/* Bound of the solutions of one problem, each with friction that looks ahead to the forces of the one before. */
enum { MOST_LEADS = 40 };

/* The present directions of the slips that are led: x[K], 0 in other rows. */
static void find_directions(const Settling *settling, const bool led[], double x[]) {
    memset(x, 0, K * sizeof *x);
    for (int row = FIRST_SLIP; row < FIRST_FRICTION; row++) {
        const int k = ROW_PLACES[row];
        x[k] = led[k] ? settling->row[k].value : 0.0;
    }
}

/* Directs the slips that are led along x[K], of any length but 0. */
static void direct(Settling *settling, const bool led[], const double x[]) {
    for (int i = 0; i < N_UNILATERALS; i++) {
        double length = 0.0;
        for (int row = SLIP_ROWS[i]; row < SLIP_ROWS[i + 1]; row++) {
            length = led[ROW_PLACES[row]] ? hypot(length, x[ROW_PLACES[row]]) : 0.0;
        }
        for (int row = SLIP_ROWS[i]; row < SLIP_ROWS[i + 1] && length > 0.0; row++) {
            settling->row[ROW_PLACES[row]].value = x[ROW_PLACES[row]] / length;
        }
    }
}

/* Solves the laws of the rows. A slow slip in space is led by its forces: friction turns the direction, and the
   direction turns the friction, until both agree, as in the motion. A foot that reaches its limit beside such slips
   gives way then by the forces that have brought it there. */
static bool solve_looking_ahead(Settling *settling, const Problem *problem) {
    const ArenaMark mark = arena_mark(settling->instance->arena);
    WORK(mark, double, answer, K);
    WORK(mark, double, x, K);
    WORK(mark, bool, led, K);
    WORK_OF(mark, Repetition, last);
    memset(last, 0, sizeof *last);
    bool solved = complementarity_solve(problem, settling->lambda, settling->w);
    for (int i = 0; i < MOST_LEADS && solved && settling_lead(settling, led, answer); i++) {
        find_directions(settling, led, x);
        proceed(last, answer, i > 0, x);
        direct(settling, led, x);
        solved = complementarity_solve(problem, settling->lambda, settling->w);
    }
    return arena_leave(mark, solved);
}

/* Finds lambda and w of all rows, and determined[] unless it is NULL. Returns false if no forces obey the laws. */
static bool solve_settled_laws(Settling *settling, bool determined[]) {
    const ArenaMark mark = arena_mark(settling->instance->arena);
    WORK_ZEROS(mark, double, multipliers, K);
    WORK_OF(mark, Limits, limits);
    WORK_OF(mark, Repetition, last);
    const Problem problem = {.arena = settling->instance->arena,
                             .rows = K,
                             .delassus = settling->delassus,
                             .free = settling->free,
                             .row = settling->row,
                             .determined = determined};
    memset(last, 0, sizeof *last);
    for (int i = 0; i < MOST_REPETITIONS; i++) {
        friction_limits(settling, multipliers, limits);
        set_rows(settling, limits->force, limits->capacity);
        if (!solve_looking_ahead(settling, &problem)) {
            return arena_leave(mark, false);
        }
        if (limits_stay(settling, limits)) {
            return arena_leave(mark, true);
        }
        proceed(last, settling->lambda, i > FEW_REPETITIONS, multipliers);
    }
    return arena_leave(mark, false);
}

/* Is the Jacobian of a slip at rest 0 to rounding, and its rate too? Then no velocities make the row slip: a slide that
   is driven by the sine of its crank is such a row at the dead centre. */
static bool vanishes(const Settling *settling, int row) {
    const double pace = states_pace(&settling->instance->state);
    const RowLaw law = settling->row[ROW_PLACES[row]].law;
    double lever = 0.0;
    for (int i = 0; i < N; i++) {
        lever = fmax(lever, fabs(settling->rows.jacobian[row * N + i]) * NOMINAL_STATES[i]);
    }
    return (law == ROW_BOUNDED || law == ROW_TANGENTIAL) && lever <= NOISE &&
           fabs(settling->rows.gamma[row]) <= NOISE * pace * pace;
}

static void find_vanishing(Settling *settling) {
    for (int row = FIRST_SLIP; row < FIRST_LATCH; row++) {
        const int k = ROW_PLACES[row];
        if (vanishes(settling, row)) {
            settling->determined[k] = true;
            settling->lambda[k] = settling->w[k] = 0.0;
        }
    }
}

/* Does a contact stick at its limit, though it is not due? */
static bool sticks_at_limit(const Settling *settling, int contact) {
    const int first = SLIP_ROWS[contact];
    double friction = 0.0;
    if (!contact_sticks(&settling->instance->state, contact) || settling->due[2 * contact + 1] ||
        settling->row[ROW_PLACES[first]].law != ROW_TANGENTIAL) {
        return false;
    }
    for (int row = first; row < SLIP_ROWS[contact + 1]; row++) {
        friction = hypot(friction, settling->lambda[ROW_PLACES[row]]);
    }
    const double limit = settling->row[ROW_PLACES[first]].holding * settling->lambda[ROW_PLACES[contact]];
    return limit > 0.0 && friction >= (1.0 - 2.0 * YIELDS) * limit;
}

/* Where a contact gives way, those that stick at the same limit are due with it: both ends of an edge, for one. Else
   they would take turns in being the last one that holds. */
static bool give_way_together(Settling *settling) {
    const State *state = &settling->instance->state;
    bool given = false, found = false;
    for (int i = 0; i < N_UNILATERALS; i++) {
        given = given || (contact_sticks(state, i) && settling->due[2 * i + 1]);
    }
    for (int i = 0; i < N_UNILATERALS && given; i++) {
        if (sticks_at_limit(settling, i)) {
            settling->due[2 * i + 1] = found = true;
        }
    }
    return found;
}

bool settling_laws(Settling *settling) {
    const ArenaMark mark = arena_mark(settling->instance->arena);
    WORK_ZEROS(mark, bool, determined, K);
    memset(settling->determined, 0, sizeof settling->determined);
    bool solved = solve_settled_laws(settling, determined);
    for (int i = 0; i < N_UNILATERALS && solved && give_way_together(settling); i++) {
        memset(determined, 0, K * sizeof(bool));
        solved = solve_settled_laws(settling, determined);
    }
    memcpy(settling->determined, determined, K * sizeof(bool));
    find_vanishing(settling);
    if (solved && any_moves_without_lever(settling)) {
        solved = solve_settled_laws(settling, NULL);
    }
    return arena_leave(mark, solved);
}

void settling_find_loads(Settling *settling, bool loaded[]) {
    const ArenaMark mark = arena_mark(settling->instance->arena);
    WORK(mark, bool, touching, SIZE_UNILATERALS);
    double greatest = 0.0;
    memcpy(touching, settling->touching, SIZE_UNILATERALS * sizeof(bool));
    for (int i = 0; i < N_UNILATERALS; i++) {
        const double velocity = settling->velocity[ROW_PLACES[i]];
        settling->touching[i] = touching[i] && velocity >= -settling_least_speed(settling, i);
    }
    memset(settling->determined, 0, sizeof settling->determined);
    const bool solved = solve_settled_laws(settling, NULL);
    memcpy(settling->touching, touching, SIZE_UNILATERALS * sizeof(bool));
    for (int k = 0; k < K && solved; k++) {
        greatest = fmax(greatest, fabs(settling->lambda[k]));
    }
    for (int i = 0; i < N_UNILATERALS && solved; i++) {
        const double force = settling->lambda[ROW_PLACES[i]];
        loaded[i] = loaded[i] || (force > OBEYED * greatest && settling_bears(settling, i, force));
    }
    arena_release(mark);
}
