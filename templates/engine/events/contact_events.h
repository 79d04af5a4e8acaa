/* Contacts, stops, dry friction and latches: their part in the events of a mechanism, see events.h.
   contact_events_none.c is for mechanisms without them. */
#ifndef CONTACT_EVENTS_H
#define CONTACT_EVENTS_H

#include <float.h>

#include "instance.h"
#include "scale.h"

/* values[N_EVENTS - N_SWITCHES]: the event functions of contacts and dry frictions at a time (s) and states, as
   events_evaluate says. */
bool contacts_evaluate(Instance *instance, double time, const double states[], double values[]);

/* Does a latch hold in one state that does not in the one before? */
bool contacts_catch(const State *before, const State *after);

/* Tells anew, from the present point, when each contact in the last rebound of its cascade comes to its top. The event
   function has remembered that time since the impact; it moves with the states. */
void contacts_foresee(Instance *instance);

/* The number of an event that the event functions do not show, or -1: a slip in space has become slower than errors of
   the states. values[N_EVENTS] are the event functions at the present point. */
int contacts_overdue(Instance *instance, const double values[]);

/* The number of the event of what sticks along a line by its mode and slips at the present point, faster than any
   other; -1: nothing does. Rows of a chain that lies almost straight are redundant, and do not hold what they have
   hardly a lever on; where they get one, they do not stick. */
int contacts_slipping(Instance *instance);

/* Where a slip in space has turned far from the direction of its mode, and is too fast to be about to rest, its present
   direction becomes that of the mode. Forces do not change there. But beyond 90 degrees they turn round, and the event
   function shows a slip that turns further as one that comes to rest: so this is done before a trial step. */
void contacts_turn(Instance *instance);

/* In model exchange the states drift off the rows that hold. Moves them back, before switches turn and the rows become
   others, so that a closed contact is at rest. *jumped is set if states changed. Returns false, with instance->failure,
   if there are no such states. */
bool contacts_undo_drift(Instance *instance, bool *jumped);

/* gaps[N_UNILATERALS] at the present point, also below 0. */
void contacts_gaps(Instance *instance, double gaps[]);

/* A switch has turned, and gaps were before[N_UNILATERALS] until then. Contacts open whose gap has jumped up, as at the
   edge of a table. Returns false, with instance->failure, where a gap has jumped below 0. */
bool contacts_jump(Instance *instance, const double before[]);

/* Does the part of events_settle for contacts; due[N_EVENTS - N_SWITCHES] or NULL. *jumped is set if states changed.
   *again is set if everything has to be decided once more, with the new states. Otherwise both are left as they are. */
bool contacts_settle(Instance *instance, const bool due[], bool *jumped, bool *again);

/* Is this a coefficient of friction? One that comes to 0 at a kink, as that of max(x, 0) does, is rounding below it. */
static inline bool coefficient_rubs(double coefficient) {
    return coefficient >= -OBEYED && coefficient <= DBL_MAX;
}

/* Is this a coefficient of restitution, 0 to 1 but for rounding? */
static inline bool coefficient_returns(double coefficient) {
    return coefficient >= -OBEYED && coefficient <= 1.0 + OBEYED;
}

/* Are the forces of dry frictions, and the coefficients of contacts that are closed, finite, and 0 or more, at a point?
   unknowns[n + m] are the accelerations and multipliers there, or NULL if they have to be found. Returns false, with
   instance->failure, if one of them is not. */
bool contacts_oppose(Instance *instance, double time, const double states[], const double unknowns[]);

/* Changes the multipliers behind the accelerations in unknowns[n + m] at the present point, where rows are redundant:
   into those of least norm among all with the same forces that obey the laws of contacts and dry friction. These are
   shown. Nothing changes where there are none. The system is factorised at the point. */
void contacts_share(Instance *instance, const System *system, double unknowns[]);

#endif
