/* Modes of contacts, stops and dry frictions, and the masks and directions that carry them out. */
#ifndef CONTACT_MODES_H
#define CONTACT_MODES_H

#include "element_rows.h"

/* How friction finds its direction while a slip in space is slow. Far below the speed `steady`, in m/s, it does not
   depend on the slip: it looks ahead by the time tau, in s, and is against the acceleration which it leaves; kappa is
   the velocity that a unit of friction makes in that time. With tau 0 it keeps the direction of the mode. Far above
   this speed it is against the slip. The mode ends where the slip has a direction by itself. */
typedef struct {
    double tau, kappa, steady;
} Outlook;

extern const Outlook NO_OUTLOOK;

/* Of a contact: open; closed, with slips at rest; closed and sliding, along w[slips]: of one slip in the direction of
   its sign. A slip in space that is not slow has an outlook of zeros. A contact without friction slides. */
void contact_open(State *state, int contact);
void contact_stick(State *state, int contact);
void contact_slide(State *state, int contact, const double w[], Outlook outlook);

/* A contact with one slip, or a dry friction, that is at rest where no force along it has a lever, as a slide is at the
   dead centre of its crank: it shows that it sticks, bears no friction, and holds nothing. It waits until its slip is
   faster than WAITING_SLIP: then the slip has a direction. */
void contact_wait(State *state, int contact);
void friction_wait(State *state, int friction);

/* The outlook of a contact; zeros where it has none. */
Outlook contact_outlook(const State *state, int contact);

/* Of a contact that slides, with the velocities slips[contact_slips] along its rows: the one along its direction, in
   m/s. */
double contact_slip_along(const State *state, int contact, const double slips[]);

/* Whether the mode of such a contact goes on: positive as long as it does. `along` is the velocity along its direction;
   a slip with an outlook may turn back by as much as errors of the states. The mode ends, too, where the slip comes to
   the speed at which it has a direction by itself. */
double contact_slip_margin(const State *state, int contact, double along, const double slips[]);

/* The steadying speed of a slip in space that begins, in units of contact_loose_speed, at which it may come to rest. */
extern const double STEADIER;

/* The speed, m/s, up to which errors of the states decide on the direction of a slip in space. */
double contact_loose_speed(const Instance *instance, const ElementRows *rows, int contact);

/* Is the contact closed, and does it stick? */
static inline bool contact_closed(const State *state, int contact) {
    return row_active(state, contact);
}

static inline bool contact_sticks(const State *state, int contact) {
    return state->modes[contact] == MODE_STICKS;
}

static inline bool contact_waits(const State *state, int contact) {
    return contact_sticks(state, contact) && !row_active(state, SLIP_ROWS[contact]);
}

/* Is the contact closed, and does it not stick? */
static inline bool contact_slides(const State *state, int contact) {
    return contact_closed(state, contact) && !contact_sticks(state, contact);
}

/* The number of rows that the contact slips along: 0, 1, or 2 in space. */
static inline int contact_slips(int contact) {
    return SLIP_ROWS[contact + 1] - SLIP_ROWS[contact];
}

/* Does the contact slide in space, in a direction of its own? */
static inline bool contact_slides_in_space(const State *state, int contact) {
    return contact_slips(contact) == 2 && contact_slides(state, contact);
}

/* Of a dry friction: at rest, or sliding in the direction of the sign of w. */
void friction_stick(State *state, int friction);
void friction_slide(State *state, int friction, double w);

static inline bool friction_sticks(const State *state, int friction) {
    return state->modes[N_UNILATERALS + friction] == MODE_STICKS;
}

static inline bool friction_waits(const State *state, int friction) {
    return friction_sticks(state, friction) && !row_active(state, FIRST_FRICTION + friction);
}

#endif
