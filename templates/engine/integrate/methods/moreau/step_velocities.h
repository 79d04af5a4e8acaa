/* Velocities at the end of a time step. The laws hold for the rows in its middle, and the mean of both ends obeys the
   permanent constraints: what an impact leaves along these would turn round in each step and never die out. Gear,
   Leimkuhler, Gupta, Automatic integration of Euler-Lagrange equations with constraints, J. Comput. Appl. Math. 12-13,
   1985. */
#ifndef STEP_VELOCITIES_H
#define STEP_VELOCITIES_H

#include "stepped_rows.h"

/* Moves the qd of states[], of which step_positions has evaluated the rows, onto the permanent constraints in the
   metric M of the step's middle, and adds the energy that this takes to the dissipated energy. */
void step_velocities(Instance *instance, double states[]);

#endif
