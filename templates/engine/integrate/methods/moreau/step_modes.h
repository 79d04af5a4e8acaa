/* The modes that the elements of a mechanism show after a time step. */
#ifndef STEP_MODES_H
#define STEP_MODES_H

#include "stepped_rows.h"

/* Turns the switches whose margins have the other sign at this time (s), in these states[2n]. Latches stay. */
void step_turn_switches(Instance *instance, double time, const double states[]);

/* Modes, counts and impulses in the State after a step that is to be accepted. Switches and latches turn as they are at
   this time (s), with states[2n] and the rows of scratch.solver.end. */
void step_modes(Instance *instance, double time, const double states[]);

#endif
