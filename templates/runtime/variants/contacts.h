/* Contacts, stops, dry friction and latches: their part in the events of a mechanism, see events.h, and in its
   accelerations. contacts_none.c is for mechanisms without them. */
#ifndef CONTACTS_H
#define CONTACTS_H

#include "instance.h"

/* values[N_EVENTS - N_SWITCHES] of their event functions, as events_evaluate says. */
bool contacts_evaluate(Instance *instance, double time, const double states[], double values[]);

/* Is an open contact below 0 by more than rounding, and approaches? An input whose position and velocity do not belong
   together can bring it there behind the back of the event functions, which see where a gap comes down to 0. Returns
   the first such contact's event function, given values[N_EVENTS] at the present point; -1 if there is none. */
int contacts_sinking(Instance *instance, const double values[]);

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

/* Does any contact, stop, dry friction or latch hold at present? The formula of the accelerations is for none. */
bool contacts_hold(const Instance *instance);

/* Are the forces of dry frictions 0 or more at a point? unknowns[n + m] are the accelerations and multipliers there, or
   NULL if they have to be found. Returns false, with instance->failure, if a force is less. */
bool contacts_oppose(Instance *instance, double time, const double states[], const double unknowns[]);

/* The number of their rows that do not hold at present: such a row bears nothing, or a force of sliding. */
int contacts_idle(const Instance *instance);

/* Do forces of friction depend on what other rows bear, so that contacts_slide has something to do? */
bool contacts_sliding(const Instance *instance);

/* Does any contact in space slide at present? */
bool contacts_slide_in_space(const Instance *instance);

/* The rate (1/s) at which friction in space turns the slowest slip into its direction; 0 if none slides. */
double contacts_decay(Instance *instance);

/* Adds to unknowns[n + m], which hold without forces of sliding, these forces and what follows from them; the system is
   factorised at the point. Returns false, with instance->failure, if no such forces are found. */
bool contacts_slide(Instance *instance, const System *system, double time, const double states[],
                    const double inputs[], double unknowns[]);

/* Changes the multipliers behind the accelerations in unknowns[n + m] at the present point, where rows are redundant:
   into those of least norm among all with the same forces that obey the laws of contacts and dry friction. These are
   shown. Nothing changes where there are none. The system is factorised at the point. */
void contacts_share(Instance *instance, const System *system, double unknowns[]);

/* Adds to forces[n] those of the rows that slide at the states. Returns false, with instance->failure, if there are no
   accelerations there. The system in scratch is then another. */
bool contacts_rub(Instance *instance, double time, const double states[], double forces[]);

/* Adds to the answer[n + m] of the unknowns to a seed at the point, which holds for constant forces of sliding, how
   these forces answer; unknowns[n + m] are those at the point, where the system is factorised. */
void contacts_answer(Instance *instance, const System *system, double time, const double states[],
                     const double inputs[], const double unknowns[], const Seed *seed, double answer[]);

/* Does what contacts_answer does for the second derivatives by time, answer[n + m], of the unknowns at the present
   point. Their first derivatives are rates[n + m]; the inputs have the derivatives du and d2u. */
void contacts_answer_twice(Instance *instance, const System *system, const double du[], const double d2u[],
                           const double rates[], double answer[]);

#endif
