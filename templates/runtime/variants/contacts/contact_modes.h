/* Modes of contacts, stops and dry frictions, and the masks and directions that carry them out. */
#ifndef CONTACT_MODES_H
#define CONTACT_MODES_H

#include "element_rows.h"

/* Of a contact: open; closed, with slips at rest; closed and sliding, along w[slips]: of one slip in the direction of
   its sign. Friction in space keeps the direction of w as long as the slip is slower than the speed `steady`, in m/s,
   and has that of the slip beyond it; 0 stands for a speed of rounding. A contact without friction slides. */
void contact_open(State *state, int contact);
void contact_stick(State *state, int contact);
void contact_slide(State *state, int contact, const double w[], double steady);

/* The speed `steady` of a slip in space, 0 for any other. */
double contact_steady(const State *state, int contact);

/* Is the contact closed, and does it stick? */
static inline bool contact_closed(const State *state, int contact) {
    return row_active(state, contact);
}

static inline bool contact_sticks(const State *state, int contact) {
    return state->modes[contact] == MODE_STICKS;
}

/* Is the contact closed, and does it not stick? */
static inline bool contact_slides(const State *state, int contact) {
    return contact_closed(state, contact) && !contact_sticks(state, contact);
}

/* The number of rows that the contact slips along: 0, 1, or 2 in space. */
static inline int contact_slips(int contact) {
    return SLIP_ROWS[contact + 1] - SLIP_ROWS[contact];
}

/* Of a dry friction: at rest, or sliding in the direction of the sign of w. */
void friction_stick(State *state, int friction);
void friction_slide(State *state, int friction, double w);

static inline bool friction_sticks(const State *state, int friction) {
    return state->modes[N_UNILATERALS + friction] == MODE_STICKS;
}

#endif
