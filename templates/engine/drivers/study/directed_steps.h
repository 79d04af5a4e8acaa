/* What differs between families of solvers when directions go through their steps. */
#ifndef DIRECTED_STEPS_H
#define DIRECTED_STEPS_H

#include "directions.h"

/* All directions through the trial step that the instance has just made: new_states, before any constraint. */
bool directions_follow(Variations *variations, Step step);

/* Has new_slope followed too, where there are no constraints? */
bool directions_have_slope(void);

/* The error of direction d in units of the tolerance, as that of the states: see solver_error. */
double directions_error(Variations *variations, int d, Step step, double tolerance);

/* Samples at the times within the step, which is about to be accepted. */
bool directions_within(Variations *variations, Step step);

#endif
