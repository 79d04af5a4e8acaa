/* Contacts, stops, dry friction and latches: their part in the accelerations of a mechanism. contacts_none.c is for
   mechanisms without them. */
#ifndef CONTACTS_H
#define CONTACTS_H

#include "instance.h"

/* Does any contact, stop, dry friction or latch hold at present? The formula of the accelerations is for none. */
bool contacts_hold(const Instance *instance);

/* The number of their rows that do not hold at present: such a row bears nothing, or a force of sliding. */
int contacts_idle(const Instance *instance);

/* Do forces of friction depend on what other rows bear, so that contacts_slide has something to do? */
bool contacts_sliding(const Instance *instance);

/* Does any contact in space slide at present? */
bool contacts_slide_in_space(const Instance *instance);

/* The rate (1/s) at which friction in space turns the slowest slip into its direction; 0 if none slides. */
double contacts_decay(Instance *instance);

/* The usual speed of the slowest slip in space over its speed: by as much rounding is magnified in its direction; 0 if
   none slides. */
double contacts_slowness(Instance *instance);

/* Adds to unknowns[n + m], which hold without forces of sliding, these forces and what follows from them; the system is
   factorised at the point. Returns false, with instance->failure, if no such forces are found. */
bool contacts_slide(Instance *instance, const System *system, double time, const double states[],
                    const double inputs[], double unknowns[]);

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
