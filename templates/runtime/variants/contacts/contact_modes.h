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
bool contact_closed(const State *state, int contact);
bool contact_sticks(const State *state, int contact);

/* Of a dry friction: at rest, or sliding in the direction of the sign of w. */
void friction_stick(State *state, int friction);
void friction_slide(State *state, int friction, double w);

bool friction_sticks(const State *state, int friction);

#endif
