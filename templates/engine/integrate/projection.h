/* Keeping solver steps on the constraints. */
#ifndef PROJECTION_H
#define PROJECTION_H

#include "solver.h"

/* Moves states[2n] at a time (s) in the communication step onto the constraints; *moved tells whether this changed
   them. This and the other functions return false, with instance->failure, if that fails. */
bool project(Instance *instance, double time, double states[], bool *moved);

/* Moves states onto the constraints, and takes their derivatives anew if that changed them. */
bool bring_back(Instance *instance, double time, double states[], double derivatives[]);

/* Does what bring_back does, for the result of a trial step. Variational methods and time stepping meet the constraints
   by themselves, with momenta that belong to these velocities; their results stay. In real time a communication step
   ends on the constraints: what its solver steps leave them by is of their own error. Numbers of type float are brought
   back in each, because rounding drives them off. */
bool bring_back_result(Instance *instance, Step step);

/* Has that moved the result by far more than errors of steps are, because the step has passed a kink of a constraint,
   within smooth(...) for one? Behind it the velocities meet the constraint no longer, and energy would vanish without a
   word. instance->failure tells of it then. */
bool passes_kink(Instance *instance, Step step);

#endif
