/* Positions at the end of a time step: velocities alone would let them drift off what holds. Acary, Projected
   event-capturing time-stepping schemes for nonsmooth mechanical systems with unilateral contact and Coulomb's
   friction, Comput. Methods Appl. Mech. Eng. 256, 2013. */
#ifndef STEP_POSITIONS_H
#define STEP_POSITIONS_H

#include "stepped_rows.h"

/* Moves the q of states[2n] in the middle of a step, at a time (s), onto the permanent constraints, by the least change
   in nominal values, and measures the rows there: off them, two points of one body may not rest. half (s) is half the
   length of the step. Returns false, with instance->failure, if M is singular. */
bool step_middle(Instance *instance, double time, double half, double states[]);

/* Moves the q of states[2n] at the end of a step in the metric M of its middle: holonomic constraints and closed
   contacts to 0, no gap below 0. Returns false, with instance->failure, if constraints are not met. */
bool step_positions(Instance *instance, Step step, double states[]);

#endif
