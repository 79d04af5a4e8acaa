/* Communication steps of co-simulation. */
#ifndef COMMUNICATION_STEP_H
#define COMMUNICATION_STEP_H

#include "instance.h"

/* Importers compute times in many ways, so times are never compared exactly: a difference of this part of the
   communication step is bridged. */
#define COMMUNICATION_POINT_TOLERANCE 1e-3

/* fmi2DoStep from the communication point (s) by step (s), where that takes more than moving the time. A call that is
   illegal or a step that cannot be: fmi2Error; one that the solver cannot complete: fmi2Discard. */
fmi2Status communication_step(fmi2Component c, double point, double step);

#endif
