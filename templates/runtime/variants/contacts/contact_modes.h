/* Modes of contacts, stops and dry frictions, and the masks and directions that carry them out. */
#ifndef CONTACT_MODES_H
#define CONTACT_MODES_H

#include "element_rows.h"

/* Of a contact: open; closed, with slips at rest; closed and sliding, along w[slips]: of one slip in the direction of
   its sign. A contact without friction slides. */
void contact_open(State *state, int contact);
void contact_stick(State *state, int contact);
void contact_slide(State *state, int contact, const double w[]);

/* Is the contact closed, and does it stick? */
static inline bool contact_closed(const State *state, int contact) {
    return row_active(state, contact);
}

static inline bool contact_sticks(const State *state, int contact) {
    return state->modes[contact] == MODE_STICKS;
}

/* Of a dry friction: at rest, or sliding in the direction of the sign of w. */
void friction_stick(State *state, int friction);
void friction_slide(State *state, int friction, double w);

static inline bool friction_sticks(const State *state, int friction) {
    return state->modes[N_UNILATERALS + friction] == MODE_STICKS;
}

#endif
