#include "contact_modes.h"

#include <math.h>
#include <stddef.h>

#include "contacts.h"

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

static int slips_of(int contact) {
    return SLIP_ROWS[contact + 1] - SLIP_ROWS[contact];
}

static void set_contact(State *state, int contact, int64_t mode, const double w[]) {
    const int count = slips_of(contact);
    double speed = 0.0;
    for (int k = 0; w != NULL && k < count; k++) {
        speed = hypot(speed, w[k]);
    }
    row_activate(state, contact, mode != MODE_OPEN);
    for (int k = 0; k < count; k++) {
        row_activate(state, SLIP_ROWS[contact] + k, mode == MODE_STICKS);
        row_direct(state, SLIP_ROWS[contact] + k, speed > 0.0 ? w[k] / speed : 0.0);
    }
    state->modes[contact] = mode;
}

void contact_open(State *state, int contact) {
    state->cascading[contact] = 0;
    set_contact(state, contact, MODE_OPEN, NULL);
}

void contact_stick(State *state, int contact) {
    set_contact(state, contact, slips_of(contact) > 0 ? MODE_STICKS : MODE_SLIDES, NULL);
}

void contact_slide(State *state, int contact, const double w[]) {
    const int64_t along = w[0] > 0.0 ? MODE_SLIDES_FORWARD : MODE_SLIDES_BACKWARD;
    set_contact(state, contact, slips_of(contact) == 1 ? along : MODE_SLIDES, w);
}

static void set_friction(State *state, int friction, int64_t mode, double direction) {
    row_activate(state, FIRST_FRICTION + friction, mode == MODE_STICKS);
    row_direct(state, FIRST_FRICTION + friction, direction);
    state->modes[N_UNILATERALS + friction] = mode;
}

void friction_stick(State *state, int friction) {
    set_friction(state, friction, MODE_STICKS, 0.0);
}

void friction_slide(State *state, int friction, double w) {
    set_friction(state, friction, w > 0.0 ? MODE_SLIDES_FORWARD : MODE_SLIDES_BACKWARD, w > 0.0 ? 1.0 : -1.0);
}
