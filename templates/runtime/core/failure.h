/* Why an evaluation or a solver step failed, in words. */
#ifndef FAILURE_H
#define FAILURE_H

#include <stddef.h>

#include "instance.h"

/* Sets instance->failure to this kind at this time, flagging coordinates[n]; returns false. */
bool report_coordinates(Instance *instance, FailureKind kind, double time, const bool coordinates[]);

/* Sets instance->failure to these accelerations[n] at this time, which are not all finite; returns false. */
bool report_accelerations(Instance *instance, double time, const double accelerations[]);

/* Writes one sentence to text[size] that says what failed, at which time, for which coordinate or state, and what to
   do; a longer one is cut. */
void failure_sentence(const Failure *failure, char text[], size_t size);

#endif
