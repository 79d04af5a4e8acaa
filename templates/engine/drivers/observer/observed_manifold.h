/* The states that meet the constraints, and the directions in which they may err. */
#ifndef OBSERVED_MANIFOLD_H
#define OBSERVED_MANIFOLD_H

#include "instance.h"

/* The basis of the changes of x[N_OBSERVED] that the constraints allow to first order, at a time (s). */
bool observed_basis(Instance *instance, double time, const double x[], double basis[][N_OBSERVED]);

/* Moves x to the nearest state that meets the constraints, by Newton's method with the least correction; parameters
   stay. Returns false, with instance->failure, where none is near. */
bool observed_project(Instance *instance, double time, double x[]);

#endif
