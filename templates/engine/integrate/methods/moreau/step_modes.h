/* The modes that the elements of a mechanism show after a time step. */
#ifndef STEP_MODES_H
#define STEP_MODES_H

#include "stepped_rows.h"

/* Modes, counts and impulses in the State after a step that is to be accepted. Switches and latches turn for the next
   step, which finds states[2n] and the rows of scratch.solver.end at this time (s). */
void step_modes(Instance *instance, double time, const double states[]);

#endif
