#include "contact_modes.h"

#include <math.h>
#include <stddef.h>

#include "contacts.h"
#include "inputs.h"
#include "scale.h"
#include "settings.h"

int contacts_idle(const Instance *instance) {
    int count = 0;
    for (int row = 0; row < N_ROWS; row++) {
        count += !row_active(&instance->state, row);
    }
    return count;
}

bool contacts_hold(const Instance *instance) {
    return contacts_idle(instance) < N_ROWS;
}

/* m/s or rad/s; to a slip in space that no errors turn, sliding friction adds this speed, so that it has a direction at
   0. Ten times more would show where a tolerance is 1e-10; less is rounding of speeds of 1e4. */
static const double LEAST_BIAS = 1e-12;

/* Sets the mode of an element. Where it begins to stick or to slide, its event function becomes another one: the margin
   of its friction, in N, instead of its slip, in m/s. What rounding has left of the one is forgotten for the other. */
static void take_mode(State *state, int element, int64_t mode, int function) {
    if ((state->modes[element] == MODE_STICKS) != (mode == MODE_STICKS)) {
        state->event_rests[N_SWITCHES + function] = 0.0;
        state->contact_sizes[function] = 0.0;
    }
    state->modes[element] = mode;
}

/* In units of the steadying speed: a slip with an outlook has a direction by itself when it is faster than BY_ITSELF,
   and has turned back when it moves against its direction faster than TURNED_BACK. */
static const double BY_ITSELF = 3.0, TURNED_BACK = 0.05;

const Outlook NO_OUTLOOK = {.tau = 0.0, .kappa = 0.0, .steady = 0.0};

/* The place of a contact in space among the outlooks, which have two parameters each. */
static int place_of_outlook(int contact) {
    int place = FIRST_OUTLOOK;
    for (int i = 0; i < contact; i++) {
        place += contact_slips(i) == 2 ? 2 : 0;
    }
    return place;
}

static void set_outlook(State *state, int contact, Outlook outlook) {
    if (SLIPS_IN_SPACE && contact_slips(contact) == 2) {
        const int place = place_of_outlook(contact);
        state->parameters[place] = outlook.tau;
        state->parameters[place + 1] = outlook.kappa;
    }
    state->slip_ends[contact] = BY_ITSELF * outlook.steady;
}

Outlook contact_outlook(const State *state, int contact) {
    Outlook outlook = {.tau = 0.0};
    if (SLIPS_IN_SPACE && contact_slips(contact) == 2) {
        const double *direction = state->parameters + FIRST_DIRECTION + SLIP_ROWS[contact] - FIRST_SLIP;
        const double *place = state->parameters + place_of_outlook(contact);
        const bool slow = place[0] > 0.0 || hypot(direction[0], direction[1]) > LEAST_BIAS * (1.0 + NOISE);
        outlook.tau = place[0];
        outlook.kappa = place[1];
        outlook.steady = slow ? state->slip_ends[contact] / BY_ITSELF : 0.0;
    }
    return outlook;
}

/* Sets the mode of a contact, and its direction to the vector w scaled to `length`; w NULL stands for 0. */
static void set_contact(State *state, int contact, int64_t mode, const double w[], double length) {
    const int count = contact_slips(contact);
    double speed = 0.0;
    for (int k = 0; w != NULL && k < count; k++) {
        speed = hypot(speed, w[k]);
    }
    if (contact_closed(state, contact) != (mode != MODE_OPEN)) {
        state->contact_sizes[2 * contact] = 0.0;
    }
    set_outlook(state, contact, NO_OUTLOOK);
    row_activate(state, contact, mode != MODE_OPEN);
    for (int k = 0; k < count; k++) {
        row_activate(state, SLIP_ROWS[contact] + k, mode == MODE_STICKS);
        row_direct(state, SLIP_ROWS[contact] + k, speed > 0.0 ? length * w[k] / speed : 0.0);
    }
    take_mode(state, contact, mode, 2 * contact + 1);
}

void contact_open(State *state, int contact) {
    state->cascading[contact] = CASCADE_NONE;
    set_contact(state, contact, MODE_OPEN, NULL, 1.0);
}

void contact_stick(State *state, int contact) {
    set_contact(state, contact, contact_slips(contact) > 0 ? MODE_STICKS : MODE_SLIDES, NULL, 1.0);
}

void contact_wait(State *state, int contact) {
    contact_stick(state, contact);
    row_activate(state, SLIP_ROWS[contact], false);
}

void contact_slide(State *state, int contact, const double w[], Outlook outlook) {
    const int64_t along = w[0] > 0.0 ? MODE_SLIDES_FORWARD : MODE_SLIDES_BACKWARD;
    if (contact_slips(contact) == 1) {
        set_contact(state, contact, along, w, 1.0);
    } else {
        set_contact(state, contact, MODE_SLIDES, w, outlook.tau > 0.0 ? LEAST_BIAS : fmax(LEAST_BIAS, outlook.steady));
        set_outlook(state, contact, outlook);
    }
}

double contact_slip_along(const State *state, int contact, const double slips[]) {
    double along = 0.0, length = 0.0;
    for (int k = 0; k < contact_slips(contact); k++) {
        const double direction = row_direction(state, SLIP_ROWS[contact] + k);
        along += direction * slips[k];
        length = hypot(length, direction);
    }
    return along / length;
}

double contact_slip_margin(const State *state, int contact, double along, const double slips[]) {
    if (contact_slips(contact) == 1 || !(state->slip_ends[contact] > 0.0)) {
        return along;
    }
    const double slow = 1.0 - hypot(slips[0], slips[1]) / state->slip_ends[contact];
    const double margin = (along + TURNED_BACK * contact_outlook(state, contact).steady) * slow;
    return slow < 0.0 ? -fabs(margin) : margin; /* an impact may throw it back fast */
}

const double STEADIER = 4.0;

/* The errors of a velocity, relative. An importer's solver keeps its tolerance in each step alone, and its steps meet a
   direction that turns ever faster: it is spared what the engine's own solver follows at sharp tolerances. */
static double velocity_errors(const Instance *instance) {
    const double tolerance = fmin(solver_tolerance(&instance->state), COARSEST_TOLERANCE);
    return instance->policy->integrate ? tolerance : fmax(tolerance, LOCATED);
}

double contact_loose_speed(const Instance *instance, const ElementRows *rows, int contact) {
    const State *state = &instance->state;
    const double least = row_least_speed(state, rows, SLIP_ROWS[contact]);
    const double tolerance = velocity_errors(instance);
    return fmax(least * (1.0 + SLIP_ERROR / AT_REST * tolerance), contact_outlook(state, contact).steady / STEADIER);
}

bool contacts_slide_in_space(const Instance *instance) {
    bool found = false;
    for (int i = 0; SLIPS_IN_SPACE && i < N_UNILATERALS; i++) {
        found = found || contact_slides_in_space(&instance->state, i);
    }
    return found;
}

/* The greatest of sizes[i] over the speed of the slip i, among the slips in space that go on; 0 if there are none. */
static double greatest_over_speed(Instance *instance, const double sizes[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, gaps, SIZE_UNILATERALS);
    WORK(mark, double, slips, SIZE_FRICTIONAL);
    const State *state = &instance->state;
    double greatest = 0.0;
    if (!contacts_slide_in_space(instance)) {
        arena_release(mark);
        return 0.0;
    }
    mechanism_slips(state->time, state->states, inputs_at(instance, state->time), state->parameters, gaps, slips);
    for (int i = 0; i < N_UNILATERALS; i++) {
        if (contact_slides_in_space(state, i)) {
            const double *slip = slips + SLIP_ROWS[i] - FIRST_SLIP;
            const double speed = hypot(slip[0], slip[1]) + contact_outlook(state, i).steady;
            greatest = fmax(greatest, sizes[i] / speed);
        }
    }
    arena_release(mark);
    return greatest;
}

double contacts_decay(Instance *instance) {
    return greatest_over_speed(instance, instance->state.slip_decelerations);
}

double contacts_slowness(Instance *instance) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, sizes, SIZE_UNILATERALS);
    for (int i = 0; i < N_UNILATERALS; i++) {
        sizes[i] = states_pace(&instance->state) * EVENT_NOMINALS[N_SWITCHES + 2 * i + 1];
    }
    const double slowness = greatest_over_speed(instance, sizes);
    arena_release(mark);
    return slowness;
}

static void set_friction(State *state, int friction, int64_t mode, double direction) {
    row_activate(state, FIRST_FRICTION + friction, mode == MODE_STICKS);
    row_direct(state, FIRST_FRICTION + friction, direction);
    take_mode(state, N_UNILATERALS + friction, mode, 2 * N_UNILATERALS + friction);
}

void friction_stick(State *state, int friction) {
    set_friction(state, friction, MODE_STICKS, 0.0);
}

void friction_wait(State *state, int friction) {
    friction_stick(state, friction);
    row_activate(state, FIRST_FRICTION + friction, false);
}

void friction_slide(State *state, int friction, double w) {
    set_friction(state, friction, w > 0.0 ? MODE_SLIDES_FORWARD : MODE_SLIDES_BACKWARD, w > 0.0 ? 1.0 : -1.0);
}
