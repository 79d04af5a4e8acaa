/* Positions at the end of a time step: velocities alone would let them drift off what holds. Acary, Projected
   event-capturing time-stepping schemes for nonsmooth mechanical systems with unilateral contact and Coulomb's
   friction, Comput. Methods Appl. Mech. Eng. 256, 2013. */
#ifndef STEP_POSITIONS_H
#define STEP_POSITIONS_H

#include "stepped_rows.h"

/* Moves the q of states[2n] at a time (s) in the metric M of the step's middle: holonomic constraints and closed
   contacts to 0, no gap below 0. Returns false, with instance->failure, if constraints are not met. */
bool step_positions(Instance *instance, double time, double states[]);

#endif
