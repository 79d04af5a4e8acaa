/* How slips begin, and how slips in space come to rest. A slip in space has a direction; where it is slow, errors of
   the states decide on the direction. */
#include <math.h>
#include <string.h>

#include "contacts.h"
#include "inputs.h"
#include "scale.h"
#include "settings.h"
#include "settling.h"

static bool slips_in_space(int contact) {
    return contact_slips(contact) == 2;
}

static double loose_speed(const Settling *settling, int contact) {
    return contact_loose_speed(settling->instance, &settling->rows, contact);
}

/* Is the slip in space so slow that it may be at rest? */
static bool is_slow(const Settling *settling, int contact) {
    return contact_slides_in_space(&settling->instance->state, contact) &&
           settling_slip_speed(settling, contact) <= loose_speed(settling, contact);
}

static void find_slips(const Settling *settling, int contact, double slips[]) {
    for (int i = 0; i < contact_slips(contact); i++) {
        slips[i] = settling->velocity[ROW_PLACES[SLIP_ROWS[contact] + i]];
    }
}

/* The slip's part along the direction of its mode, m/s; below 0 where it has turned back. */
static double along_direction(const Settling *settling, int contact) {
    double slips[2] = {0.0};
    find_slips(settling, contact, slips);
    return contact_slip_along(&settling->instance->state, contact, slips);
}

/* Has an importer's solver that locates no events stepped over the stop of a slip in space? The slip has then turned
   back by more than errors of location, and is no faster than friction could have made it in that step, from one limit
   to the other. A slip that turns round without a stop is found at a right angle to its direction. */
static bool is_overstepped(const Settling *settling, int contact) {
    const State *state = &settling->instance->state;
    const double gained = 2.0 * state->slip_decelerations[contact] * settling_last_step(settling->instance);
    return settling->due[2 * contact + 1] && contact_slides_in_space(state, contact) &&
           settling_slip_speed(settling, contact) <= gained &&
           along_direction(settling, contact) < -loose_speed(settling, contact);
}

/* Does a slip in space come to rest here? It does if it is slow and due: it has then turned away from the direction of
   its mode. One that is slow at the event of another contact comes to rest, too, unless it has an outlook: it would
   turn within errors of the states. */
static bool comes_to_rest(const Settling *settling, int contact) {
    const bool steadied = contact_outlook(&settling->instance->state, contact).steady > 0.0;
    return ((settling->due[2 * contact + 1] || !steadied) && is_slow(settling, contact)) ||
           is_overstepped(settling, contact);
}

/* Brings velocity[] up to date for contacts in space, if one of them slides. */
static void find_velocities(Settling *settling) {
    const State *state = &settling->instance->state;
    if (!contacts_slide_in_space(settling->instance)) {
        return;
    }
    rows_evaluate(settling->instance, state->time, state->states, inputs_at(settling->instance, state->time),
                  &settling->rows);
    for (int row = 0; row < N_ROWS; row++) {
        settling->velocity[ROW_PLACES[row]] = settling->rows.velocities[row];
    }
}

bool settling_stop_in_space(Settling *settling, bool *jumped) {
    bool stops = false;
    find_velocities(settling);
    for (int i = 0; i < N_UNILATERALS; i++) {
        stops = stops || comes_to_rest(settling, i);
    }
    if (!stops) {
        return true;
    }
    for (int i = 0; i < N_UNILATERALS; i++) { /* all that are slow: none is located more sharply than the due one */
        if (is_slow(settling, i) || is_overstepped(settling, i)) {
            contact_stick(&settling->instance->state, i);
            settling->due[2 * i + 1] = false;
        }
    }
    return settling_move(settling, jumped);
}

/* Is the friction of a contact more than rounding of forces? A foot that bears no load, because others bear it, has no
   friction, and rounding has no direction. */
static bool bears_friction(const Settling *settling, int contact) {
    bool found = false;
    for (int row = SLIP_ROWS[contact]; row < SLIP_ROWS[contact + 1]; row++) {
        found = found || settling_bears(settling, contact, fabs(settling->lambda[ROW_PLACES[row]]));
    }
    return found;
}

/* The velocity or acceleration along a row with which the slip of a closed contact goes on or begins. A slip in space
   begins against the friction, as Coulomb's law says; where w is small the friction tells the direction better. */
static double slip_begins(const Settling *settling, int contact, int row) {
    const int place = ROW_PLACES[row];
    if (settling->row[place].law == ROW_SLIDING) {
        return settling_slip_velocity(settling, contact, row);
    }
    return slips_in_space(contact) && bears_friction(settling, contact) ? -settling->lambda[place] : settling->w[place];
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

/* What a unit of friction alone makes of the acceleration of a slip, at most. */
static double slip_mobility(const Settling *settling, int contact) {
    double greatest = 0.0;
    for (int row = SLIP_ROWS[contact]; row < SLIP_ROWS[contact + 1]; row++) {
        const int k = ROW_PLACES[row];
        greatest = fmax(greatest, settling->delassus[k * K + k]);
    }
    return greatest;
}

/* In units of the time in which velocities change by their nominal values: friction looks ahead no farther, also where
   a contact bears too little to rub. A direction turns by less than errors of a step in it. */
static const double FARTHEST_OUTLOOK = 1e-3;

/* The outlook of a slip in space that begins from rest, with this `deceleration` by friction, m/s^2. Its speed is above
   the errors of the states, below which a slip has no direction. The rate at which friction turns a slip into its
   direction is its deceleration over the speed; steps of a fixed length h follow rates up to 1/h. In model exchange the
   slip keeps its direction: an importer's solver may find its Jacobian by changes of 1e-17 m/s, and friction that looks
   ahead is known to its rounding only. */
static Outlook outlook_of_slip(const Settling *settling, int contact, double mobility, double deceleration) {
    const State *state = &settling->instance->state;
    const double setting = state->settings[SETTING_STEP];
    const double step = ADAPTIVE ? 0.0 : setting > 0.0 ? setting : DEFAULT_SOLVER_STEP;
    const double steady = fmax(STEADIER * loose_speed(settling, contact), step * deceleration);
    const double farthest = FARTHEST_OUTLOOK / states_pace(state);
    const double time = steady < farthest * deceleration ? steady / deceleration : farthest;
    const double tau = settling->instance->policy->integrate ? time : 0.0;
    const Outlook outlook = {.tau = tau, .kappa = tau * mobility, .steady = steady};
    return outlook;
}

/* Does a slip with an outlook go on? It does unless it is due, or turned back by an impact of another contact. */
static bool goes_on(const Settling *settling, int contact) {
    const State *state = &settling->instance->state;
    double slips[2] = {0.0};
    if (!contact_slides(state, contact) || !(contact_outlook(state, contact).steady > 0.0) ||
        settling->due[2 * contact + 1]) {
        return false;
    }
    find_slips(settling, contact, slips);
    return contact_slip_margin(state, contact, contact_slip_along(state, contact, slips), slips) > 0.0;
}

void settling_slip_direction(const Settling *settling, int contact, double direction[]) {
    const State *state = &settling->instance->state;
    const int first = SLIP_ROWS[contact];
    const double steady = goes_on(settling, contact) ? contact_outlook(state, contact).steady : 0.0;
    double length = 0.0, along[2] = {0.0};
    for (int i = 0; i < contact_slips(contact); i++) {
        along[i] = row_direction(state, first + i);
        length = hypot(length, along[i]);
    }
    for (int i = 0; i < contact_slips(contact); i++) {
        const double slip = settling_slip_velocity(settling, contact, first + i);
        direction[i] = steady > 0.0 ? slip + steady * along[i] / length : slip;
    }
}

/* direction[2]: to where the forces found lead the slip of a contact in space; of length 1, that of before at rest. */
static void lead(const Settling *settling, int contact, double direction[]) {
    const Outlook outlook = contact_outlook(&settling->instance->state, contact);
    const int first = SLIP_ROWS[contact], k[2] = {ROW_PLACES[first], ROW_PLACES[first + 1]};
    for (int i = 0; i < 2; i++) {
        direction[i] = settling_slip_velocity(settling, contact, first + i) + outlook.tau * settling->w[k[i]] -
                       outlook.kappa * settling->lambda[k[i]];
    }
    const double length = hypot(direction[0], direction[1]);
    for (int i = 0; i < 2; i++) {
        direction[i] = length > 0.0 ? direction[i] / length : settling->row[k[i]].value;
    }
}

/* Does the slip of a contact in space go on with friction that looks ahead? */
static bool looks_ahead(const Settling *settling, int contact) {
    return contact_slips(contact) == 2 && contact_outlook(&settling->instance->state, contact).tau > 0.0 &&
           settling->row[ROW_PLACES[SLIP_ROWS[contact]]].law == ROW_SLIDING && goes_on(settling, contact);
}

bool settling_lead(const Settling *settling, bool led[], double directions[]) {
    bool turned = false;
    memset(led, 0, K * sizeof *led);
    memset(directions, 0, K * sizeof *directions);
    for (int i = 0; i < N_UNILATERALS; i++) {
        double direction[2];
        if (!looks_ahead(settling, i)) {
            continue;
        }
        lead(settling, i, direction);
        for (int j = 0; j < 2; j++) {
            const int k = ROW_PLACES[SLIP_ROWS[i] + j];
            led[k] = true;
            directions[k] = direction[j];
            turned = turned || fabs(direction[j] - settling->row[k].value) > OBEYED;
        }
    }
    return turned;
}

/* An importer's solver begins anew where a slip in space has become faster by this factor. Friction turns a slip the
   less stiffly, the faster it is. CVODE keeps the Jacobian of the slow slip for up to 50 steps, and accepts steps with
   it that are wrong by 1000 tolerances; with this factor 30 are left, with 10 twice as many. */
static const double FASTER = 5.0;

/* The contact slides along w[slips] from here on. A slip in space has an outlook, unless it has a speed already. Then
   an importer's solver begins anew where it is faster. */
static void slide(Settling *settling, int contact, const double w[]) {
    State *state = &settling->instance->state;
    const bool goes = settling->row[ROW_PLACES[SLIP_ROWS[contact]]].law == ROW_SLIDING;
    const double mobility = slip_mobility(settling, contact);
    const double deceleration = settling->friction[contact] * settling->lambda[ROW_PLACES[contact]] * mobility;
    const bool slow = slips_in_space(contact) && !goes;
    contact_slide(state, contact, w, slow ? outlook_of_slip(settling, contact, mobility, deceleration) : NO_OUTLOOK);
    state->slip_decelerations[contact] = deceleration;
    if (slips_in_space(contact) && goes && !settling->instance->policy->integrate) {
        state->slip_ends[contact] = FASTER * settling_slip_speed(settling, contact);
    }
}

/* The contact slips along w[slips] from here on. */
static void begin_slip(Settling *settling, int contact, const double w[]) {
    slide(settling, contact, w);
    if (slips_in_space(contact)) { /* the speed along a new direction is another function */
        settling->instance->state.event_rests[N_SWITCHES + 2 * contact + 1] = 0.0;
    }
}

void settling_give_way(Settling *settling, int contact, const double loads[]) {
    double against[2] = {0.0};
    settling->lambda[ROW_PLACES[contact]] = loads[ROW_PLACES[contact]];
    for (int i = 0; i < contact_slips(contact); i++) {
        against[i] = -loads[ROW_PLACES[SLIP_ROWS[contact] + i]];
    }
    begin_slip(settling, contact, against);
}

/* Is the contact one that friction cannot hold? At rest it slides all the same, as something else may hold the same
   motion, such as the other side of a corner: a row that sticks would share its load, beyond a limit of 0. */
static bool holds_nothing(const Settling *settling, int contact) {
    return contact_slips(contact) > 0 && !(settling->row[ROW_PLACES[SLIP_ROWS[contact]]].holding > 0.0);
}

/* Slides without a slip. The direction is that of before, if there is one; no friction depends on it. */
static void slide_at_rest(Settling *settling, int contact) {
    State *state = &settling->instance->state;
    const int first = SLIP_ROWS[contact];
    double along[2] = {0.0};
    for (int i = 0; i < contact_slips(contact); i++) {
        along[i] = row_direction(state, first + i);
    }
    if (hypot(along[0], along[1]) == 0.0) {
        along[0] = 1.0;
    }
    slide(settling, contact, along);
}

void settling_carry_out_slip(Settling *settling, int contact) {
    State *state = &settling->instance->state;
    const int row = ROW_PLACES[SLIP_ROWS[contact]];
    if (!slips(settling, contact) && holds_nothing(settling, contact)) {
        slide_at_rest(settling, contact);
    } else if (!slips(settling, contact)) {
        const bool waits = contact_slips(contact) == 1 && settling->determined[row];
        (waits ? contact_wait : contact_stick)(state, contact);
    } else if (settling->row[row].law != ROW_SLIDING || !goes_on(settling, contact)) {
        double begins[2] = {0.0};
        for (int i = 0; i < contact_slips(contact); i++) {
            begins[i] = slip_begins(settling, contact, SLIP_ROWS[contact] + i);
        }
        begin_slip(settling, contact, begins);
    }
}
