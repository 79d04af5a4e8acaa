/* The linearized equations of a step of Radau IIA. */
#ifndef DIRECTED_RADAU_H
#define DIRECTED_RADAU_H

#include "directions.h"

/* Factorises, in the memory of the method, the equations that small changes of the accelerations[STAGES * r] at the
   stages of the step from the present point obey; or their transpose. Returns false, with instance->failure, if they
   have no solution. */
bool radau_linearize(Variations *variations, Step step, const double accelerations[], bool transposed);

#endif
