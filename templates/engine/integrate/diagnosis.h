/* Reasons that lie behind failures, and failures that are to be foreseen. */
#ifndef DIAGNOSIS_H
#define DIAGNOSIS_H

#include "instance.h"

/* After a solver step has failed for its error: replaces this reason if a mass matrix is about to become singular, or
   if forces hardly depend on a coordinate without mass. */
void explain_failure(Instance *instance);

/* An importer's solver says nothing when it fails: tells, with instance->failure, whether the mass matrix is about to
   become singular and the accelerations[n] grow so that no solver will go on for long. */
bool runs_into_singularity(Instance *instance, const double accelerations[]);

/* A fixed step has no error estimate that would grow where M becomes singular: tells, with instance->failure, whether
   the last one, of this length (s), has an end near such a place and changes velocities otherwise than the
   accelerations at both its ends say. */
bool leaps_over_singularity(Instance *instance, double length);

#endif
