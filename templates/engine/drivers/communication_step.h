/* Communication steps: whether they may be taken. */
#ifndef COMMUNICATION_STEP_H
#define COMMUNICATION_STEP_H

#include <stddef.h>

#include "instance.h"

/* May a communication step of this length (s) start at this communication point (s)? If not, writes to text[size] a
   sentence that says why. */
bool communication_step_possible(const Instance *instance, double point, double step, char text[], size_t size);

#endif
