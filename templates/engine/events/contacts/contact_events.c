/* The event functions of contacts and dry frictions. Each is positive as long as the mode goes on. A contact has two:

       mode       first                second
       open       gap                  1; in the last rebound of a cascade the time (s) to its top
       closed     normal force         slides: slip velocity along its direction
                                       sticks: margin of the friction cone, holding N - |T|
                                       waits for a lever: WAITING_SLIP - |slip velocity|

   A dry friction has the second one alone. */
#include "contact_events.h"

#include <math.h>
#include <string.h>

#include "accelerations.h"
#include "contact_modes.h"
#include "contacts.h"
#include "failure.h"
#include "inputs.h"
#include "scale.h"
#include "settings.h"
#include "shared_loads.h"
#include "system.h"

/* In units of the tolerance of velocities: a slip in space that is slower may be at rest soon. It keeps the direction
   of its mode, along which the event function comes down to 0; a faster one may take its own direction. */
static const double LOOK_AT_SLIPS = 1e3;

/* What the event functions are made of. */
typedef struct {
    double gaps[SIZE_UNILATERALS], slips[SIZE_FRICTIONAL]; /* slip velocities of the rows that may slide */
    double changes[SIZE_FRICTIONAL]; /* accelerations of these rows, of contacts whose friction looks ahead */
    double unknowns[N_UNKNOWNS];
    double friction[SIZE_UNILATERALS], holding[SIZE_UNILATERALS];
    double sliding[SIZE_FRICTIONAL], force[SIZE_FRICTIONS], capacity[SIZE_FRICTIONS];
    double bears[LOADED_FRICTION ? SIZE_FRICTIONS * N_CONSTRAINTS : 1]; /* see Sharing */
    double told; /* the scaled margin up to which the unknowns tell one, see loads_centre; HUGE_VAL: they tell all */
    const double *scale; /* [m] of the rows */
} ContactPoint;

/* Does some event function depend on forces? */
static bool loaded(const State *state) {
    bool found = false;
    for (int i = 0; i < N_UNILATERALS; i++) {
        found = found || contact_closed(state, i);
    }
    for (int i = 0; i < N_FRICTIONS; i++) {
        found = found || friction_sticks(state, i);
    }
    return found;
}

static double force_of(const ContactPoint *point, int row) {
    return point->unknowns[N_COORDINATES + ROW_PLACES[row]];
}

/* |T|: the magnitude of a contact's friction force. */
static double friction_of(const ContactPoint *point, int contact) {
    double square = 0.0;
    for (int row = SLIP_ROWS[contact]; row < SLIP_ROWS[contact + 1]; row++) {
        square += force_of(point, row) * force_of(point, row);
    }
    return sqrt(square);
}

/* The margin of a row, cut at point->told: greater margins of shared loads are not unique. */
static double told_of(const ContactPoint *point, int row, double margin) {
    const double scale = point->told < HUGE_VAL ? point->scale[ROW_PLACES[row]] : 0.0;
    return scale > 0.0 ? fmin(margin, point->told * scale) : margin;
}

/* The normal force. Where loads are shared, all ways may have one margin of a friction cone, and forces from its tip
   on. The margin then tells that the force is above 0, and which of the ways is taken does not matter. */
static double force_told(const State *state, const ContactPoint *point, int contact) {
    const double force = force_of(point, contact), most = told_of(point, contact, HUGE_VAL);
    const bool held = contact_sticks(state, contact) && point->holding[contact] > 0.0 && force > 0.0;
    return held && most < HUGE_VAL ? most : fmin(force, most);
}

/* The event function of a contact that is closed for the rest of accumulating impacts. The rest ends at rest_time, or
   earlier where the contact's force comes down to 0; the product of the time left and the force is 0 at the first of
   the two, and smooth up to there. */
static double rest_of_impacts(const State *state, double time, int contact, double force) {
    const double left = state->rest_time[contact] - time;
    return left <= 0.0 ? left : force <= 0.0 ? force : left * force;
}

/* The cosine of 60 degrees. Where the angle between a slip in space and the direction of its mode is greater, the mode
   takes the direction of the slip. */
static const double TURNED_AWAY = 0.5;

/* The velocity against the friction of a contact that it looks ahead to: the slip, and what becomes of it in the time
   tau. Below 0, friction would stop the slip before. */
static double ahead_of(const State *state, const ContactPoint *point, int contact) {
    const double friction = friction_of(point, contact), tau = contact_outlook(state, contact).tau;
    double along = 0.0;
    for (int row = SLIP_ROWS[contact]; row < SLIP_ROWS[contact + 1]; row++) {
        const int k = row - FIRST_SLIP;
        along -= force_of(point, row) * (point->slips[k] + tau * point->changes[k]);
    }
    return friction > 0.0 ? along / friction : 0.0;
}

/* The event function of a slip. In model exchange a slip in space has turned away from its direction before it is at a
   right angle to it, where the sign of friction turns: importers cannot get past that sign where the slip is fast. */
static double slip_margin(const State *state, const ContactPoint *point, int contact) {
    const double *slips = point->slips + SLIP_ROWS[contact] - FIRST_SLIP;
    if (!SLIPS_IN_SPACE) {
        return contact_slip_along(state, contact, slips);
    }
    const Outlook outlook = contact_outlook(state, contact);
    const double forward =
        outlook.tau > 0.0 ? ahead_of(state, point, contact) : contact_slip_along(state, contact, slips);
    const double margin = contact_slip_margin(state, contact, forward, slips);
    if (!contact_slides_in_space(state, contact) || outlook.steady > 0.0 || !(state->slip_ends[contact] > 0.0)) {
        return margin;
    }
    const double x = row_direction(state, SLIP_ROWS[contact]), y = row_direction(state, SLIP_ROWS[contact] + 1);
    const double along = (x * slips[0] + y * slips[1]) / hypot(x, y);
    const double size = states_pace(state) * EVENT_NOMINALS[N_SWITCHES + 2 * contact + 1];
    const double slow = SLIP_ERROR * solver_tolerance(state) * size;
    return fmin(margin, along - TURNED_AWAY * (hypot(slips[0], slips[1]) - slow));
}

static void evaluate_contact(const State *state, const ContactPoint *point, double time, int contact, double values[]) {
    values[1] = 1.0;
    if (!contact_closed(state, contact)) {
        values[0] = point->gaps[contact];
        values[1] = state->cascading[contact] == CASCADE_RISES ? state->top_time[contact] - time : 1.0;
        return;
    }
    values[0] = force_told(state, point, contact);
    if (state->cascading[contact]) {
        values[0] = rest_of_impacts(state, time, contact, values[0]);
    }
    if (contact_waits(state, contact)) {
        values[1] = WAITING_SLIP - fabs(point->slips[SLIP_ROWS[contact] - FIRST_SLIP]);
    } else if (contact_sticks(state, contact)) {
        const double holding = fmax(point->friction[contact], point->holding[contact]);
        values[1] = told_of(point, contact, holding * force_of(point, contact) - friction_of(point, contact));
    } else if (SLIP_ROWS[contact + 1] > SLIP_ROWS[contact]) {
        values[1] = slip_margin(state, point, contact);
    }
}

static double evaluate_friction(const State *state, const ContactPoint *point, int friction) {
    const int row = FIRST_FRICTION + friction;
    if (friction_waits(state, friction)) {
        return WAITING_SLIP - fabs(point->slips[row - FIRST_SLIP]);
    }
    if (friction_sticks(state, friction)) {
        return told_of(point, row, point->capacity[friction] - fabs(force_of(point, row)));
    }
    return row_direction(state, row) * point->slips[row - FIRST_SLIP];
}

static void find_limits(Instance *instance, double time, const double states[], ContactPoint *point) {
    const double *inputs = inputs_at(instance, time), *parameters = instance->state.parameters;
    mechanism_contacts(time, states, inputs, parameters, point->friction, point->holding);
    mechanism_friction(time, states, inputs, parameters, point->unknowns, point->sliding, point->force,
                       point->capacity);
    for (int i = 0; i < N_FRICTIONS; i++) {
        point->capacity[i] = fmax(point->force[i], point->capacity[i]);
    }
}

/* Of the greatest multiplier: how far each is moved to see what it adds to capacities. They are linear in it but for
   the kink of abs(...) at 0, away from which it is moved. */
static const double MOVED = 0.01;

/* What each multiplier adds to the capacities, of which point->capacity becomes what is left without loads. */
static void find_bears(Instance *instance, double time, const double states[], const double scale[],
                       ContactPoint *point) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, whole, SIZE_FRICTIONS);
    WORK(mark, double, left, SIZE_FRICTIONS);
    double *multipliers = point->unknowns + N_COORDINATES, greatest = 0.0;
    memcpy(whole, point->capacity, sizeof point->capacity);
    memcpy(left, point->capacity, sizeof point->capacity);
    for (int k = 0; k < N_CONSTRAINTS; k++) {
        greatest = fmax(greatest, fabs(multipliers[k]));
    }
    for (int k = 0; k < N_CONSTRAINTS; k++) {
        const double kept = multipliers[k], step = scale[k] > 0.0 ? copysign(MOVED * greatest, kept) : 0.0;
        multipliers[k] += step;
        find_limits(instance, time, states, point);
        multipliers[k] = kept;
        for (int i = 0; i < N_FRICTIONS; i++) {
            double *bears = &point->bears[i * N_CONSTRAINTS + k];
            *bears = step != 0.0 ? (point->capacity[i] - whole[i]) / step : 0.0;
            left[i] -= *bears * kept;
        }
    }
    memcpy(point->capacity, left, sizeof point->capacity);
    arena_release(mark);
}

/* What may be shared, by the limits; where these depend on loads, at the loads of least norm. */
static Sharing find_sharing(Instance *instance, const System *system, double time, const double states[],
                            ContactPoint *point) {
    if (LOADED_FRICTION) {
        multipliers_spread(system, point->unknowns);
    }
    find_limits(instance, time, states, point);
    if (LOADED_FRICTION) {
        find_bears(instance, time, states, system->constraints.scale, point);
    }
    return (Sharing){.arena = instance->arena,
                     .state = &instance->state,
                     .constraints = &system->constraints,
                     .holding = point->holding,
                     .capacity = point->capacity,
                     .bears = LOADED_FRICTION ? point->bears : NULL};
}

void contacts_share(Instance *instance, const System *system, double unknowns[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_OF(mark, ContactPoint, point);
    const State *state = &instance->state;
    if (!multipliers_unique(instance)) {
        memcpy(point->unknowns, unknowns, sizeof point->unknowns);
        const Sharing sharing = find_sharing(instance, system, state->time, state->states, point);
        loads_obey(&sharing, unknowns + N_COORDINATES);
    }
    arena_release(mark);
}

/* Chooses the multipliers that the event functions are made of, where redundant rows share loads in many ways. Modes go
   on as long as any way to share obeys the laws. So the loads of least norm are taken if all their margins are wide,
   else the loads whose least margin is greatest (loads_centre). */
static void choose_loads(Instance *instance, double time, const double states[], ContactPoint *point) {
    Scratch *scratch = &instance->scratch;
    point->told = HUGE_VAL;
    point->scale = scratch->system.constraints.scale;
    if (!multipliers_unique(instance)) {
        const Sharing sharing = find_sharing(instance, &scratch->system, time, states, point);
        double *multipliers = point->unknowns + N_COORDINATES;
        const bool well = instance->shown_loads != LOADS_CENTRED && loads_least(&sharing, multipliers);
        if (!well && instance->shown_loads != LOADS_LEAST) {
            point->told = loads_centre(&sharing, multipliers);
        }
        scratch->loads_shared = true;
    }
    find_limits(instance, time, states, point);
}

/* The accelerations of the slips whose friction looks ahead. */
static void find_changes(Instance *instance, double time, const double states[], ContactPoint *point) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_OF(mark, ElementRows, rows);
    bool looked = false;
    for (int i = 0; SLIPS_IN_SPACE && i < N_UNILATERALS; i++) {
        looked = looked || contact_outlook(&instance->state, i).tau > 0.0;
    }
    if (SLIPS_IN_SPACE && looked) {
        rows_evaluate(instance, time, states, inputs_at(instance, time), rows);
    }
    for (int row = FIRST_SLIP; SLIPS_IN_SPACE && looked && row < FIRST_FRICTION; row++) {
        point->changes[row - FIRST_SLIP] = row_acceleration(rows, row, point->unknowns);
    }
    arena_release(mark);
}

bool contacts_evaluate(Instance *instance, double time, const double states[], double values[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_OF(mark, ContactPoint, point);
    const State *state = &instance->state;
    const double *inputs = inputs_at(instance, time), *parameters = state->parameters;
    memset(point->unknowns, 0, sizeof point->unknowns);
    if (loaded(state)) {
        if (!accelerations_at(instance, time, states, inputs, point->unknowns)) {
            return arena_leave(mark, false);
        }
        choose_loads(instance, time, states, point);
        if (instance->arena->refused > 0) {
            const double refused = (double)instance->arena->refused;
            return arena_leave(mark, report_amount(instance, FAILURE_MEMORY, time, refused));
        }
    }
    mechanism_slips(time, states, inputs, parameters, point->gaps, point->slips);
    find_changes(instance, time, states, point);
    for (int i = 0; i < N_UNILATERALS; i++) {
        evaluate_contact(state, point, time, i, values + 2 * i);
    }
    for (int i = 0; i < N_FRICTIONS; i++) {
        values[2 * N_UNILATERALS + i] = evaluate_friction(state, point, i);
    }
    return arena_leave(mark, true);
}

bool contacts_catch(const State *before, const State *after) {
    bool caught = false;
    for (int i = 0; i < N_LATCHES; i++) {
        caught = caught || (row_active(after, FIRST_LATCH + i) && !row_active(before, FIRST_LATCH + i));
    }
    return caught;
}

void contacts_foresee(Instance *instance) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, unknowns, N_UNKNOWNS);
    WORK_OF(mark, ElementRows, rows);
    State *state = &instance->state;
    const double *inputs = inputs_at(instance, state->time);
    bool rises = false;
    for (int i = 0; i < N_UNILATERALS; i++) {
        rises = rises || state->cascading[i] == CASCADE_RISES;
    }
    if (!rises || !accelerations_at(instance, state->time, state->states, inputs, unknowns)) {
        arena_release(mark);
        return;
    }
    rows_evaluate(instance, state->time, state->states, inputs, rows);
    for (int i = 0; i < N_UNILATERALS; i++) {
        const double a = -row_acceleration(rows, i, unknowns);
        if (state->cascading[i] == CASCADE_RISES && a > 0.0) {
            state->top_time[i] = state->time + rows->velocities[i] / a;
        }
    }
    arena_release(mark);
}

/* Is a slip in space that is not steadied slower than errors of the states? Its direction is then noise, which the
   solver would follow in ever shorter steps. */
static bool fades(const Instance *instance, const ElementRows *rows, int contact) {
    const State *state = &instance->state;
    const int first = SLIP_ROWS[contact];
    return contact_slides_in_space(state, contact) && !(contact_outlook(state, contact).steady > 0.0) &&
           hypot(rows->velocities[first], rows->velocities[first + 1]) <= contact_loose_speed(instance, rows, contact);
}

/* LOOK_AT_SLIPS tolerances of the greatest velocity, for the slip of a contact in space, m/s or rad/s. */
static double slow_slip(const State *state, int contact) {
    return LOOK_AT_SLIPS * solver_tolerance(state) * states_pace(state) * EVENT_NOMINALS[N_SWITCHES + 2 * contact + 1];
}

void contacts_turn(Instance *instance) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, gaps, SIZE_UNILATERALS);
    WORK(mark, double, slips, SIZE_FRICTIONAL);
    State *state = &instance->state;
    if (!contacts_slide_in_space(instance)) {
        arena_release(mark);
        return;
    }
    mechanism_slips(state->time, state->states, inputs_at(instance, state->time), state->parameters, gaps, slips);
    for (int i = 0; i < N_UNILATERALS; i++) {
        const double *slip = slips + SLIP_ROWS[i] - FIRST_SLIP;
        if (!contact_slides_in_space(state, i) || contact_outlook(state, i).steady > 0.0) {
            continue;
        }
        const double along = contact_slip_along(state, i, slip), speed = hypot(slip[0], slip[1]);
        if (speed > slow_slip(state, i) && along > 0.0 && along < TURNED_AWAY * speed) {
            contact_slide(state, i, slip, NO_OUTLOOK);
        }
    }
    arena_release(mark);
}

int contacts_overdue(Instance *instance, const double values[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_OF(mark, ElementRows, rows);
    const State *state = &instance->state;
    const double *margins = values + N_SWITCHES;
    bool slow = false;
    int overdue = -1;
    for (int i = 0; i < N_UNILATERALS; i++) {
        slow = slow || (contact_slides_in_space(state, i) && margins[2 * i + 1] < slow_slip(state, i));
    }
    if (slow) {
        rows_evaluate(instance, state->time, state->states, inputs_at(instance, state->time), rows);
    }
    for (int i = 0; i < N_UNILATERALS && slow && overdue < 0; i++) {
        overdue = fades(instance, rows, i) ? 2 * i + 1 : -1;
    }
    arena_release(mark);
    return overdue;
}

/* Notes the event of a row that sticks if it slips faster than all before; *fastest is in units of a speed at rest. */
static void note_slipping(const State *state, const ElementRows *rows, int row, int event, double *fastest,
                          int *which) {
    const double speed = fabs(rows->velocities[row]) / row_least_speed(state, rows, row);
    if (speed > *fastest) {
        *fastest = speed;
        *which = event;
    }
}

int contacts_slipping(Instance *instance) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_OF(mark, ElementRows, rows);
    const State *state = &instance->state;
    double fastest = 1.0;
    int slipping = -1;
    rows_evaluate(instance, state->time, state->states, inputs_at(instance, state->time), rows);
    for (int i = 0; i < N_UNILATERALS; i++) {
        if (contact_slips(i) == 1 && contact_closed(state, i) && contact_sticks(state, i)) {
            note_slipping(state, rows, SLIP_ROWS[i], 2 * i + 1, &fastest, &slipping);
        }
    }
    for (int i = 0; i < N_FRICTIONS; i++) {
        if (friction_sticks(state, i)) {
            note_slipping(state, rows, FIRST_FRICTION + i, 2 * N_UNILATERALS + i, &fastest, &slipping);
        }
    }
    arena_release(mark);
    return slipping;
}

bool contacts_oppose(Instance *instance, double time, const double states[], const double unknowns[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_OF(mark, ContactPoint, point);
    double greatest = 1.0;
    if (N_FRICTIONS == 0 && !CHANGING_FRICTION) {
        return arena_leave(mark, true);
    }
    memset(point->unknowns, 0, sizeof point->unknowns);
    if (unknowns != NULL) {
        memcpy(point->unknowns, unknowns, sizeof point->unknowns);
    } else if (LOADED_FRICTION &&
               !accelerations_at(instance, time, states, inputs_at(instance, time), point->unknowns)) {
        return arena_leave(mark, false);
    }
    find_limits(instance, time, states, point);
    for (int i = 0; CHANGING_FRICTION && i < N_UNILATERALS; i++) {
        if (contact_closed(&instance->state, i) && !coefficient_rubs(point->friction[i])) {
            return arena_leave(
                mark, report_constraint(instance, FAILURE_FRICTION, time, ROW_PLACES[i], point->friction[i]));
        }
    }
    for (int k = N_COORDINATES; k < N_UNKNOWNS; k++) {
        greatest = fmax(greatest, fabs(point->unknowns[k]));
    }
    for (int i = 0; i < N_FRICTIONS; i++) {
        if (!(point->force[i] >= -OBEYED * greatest && point->force[i] <= DBL_MAX)) {
            const int row = ROW_PLACES[FIRST_FRICTION + i];
            return arena_leave(mark, report_constraint(instance, FAILURE_PUSHING, time, row, point->force[i]));
        }
    }
    return arena_leave(mark, true);
}
