/* Communication steps: whether they may be taken. */
#ifndef COMMUNICATION_STEP_H
#define COMMUNICATION_STEP_H

#include <stddef.h>

#include "instance.h"

/* Importers compute times in many ways, so times are never compared exactly: a difference of this part of the
   communication step is bridged. */
#define COMMUNICATION_POINT_TOLERANCE 1e-3

/* May a communication step of this length (s) start at this communication point (s)? If not, writes to text[size] a
   sentence that says why. */
bool communication_step_possible(const Instance *instance, double point, double step, char text[], size_t size);

#endif
