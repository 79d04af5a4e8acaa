/* Why an evaluation or a solver step failed, as data. */
#ifndef FAILURE_H
#define FAILURE_H

#include "instance.h"

/* Sets instance->failure to this kind at this time, flagging coordinates[n]; returns false. */
bool report_coordinates(Instance *instance, FailureKind kind, double time, const bool coordinates[]);

/* Sets instance->failure to these accelerations[n] at this time, which are not all finite; returns false. */
bool report_accelerations(Instance *instance, double time, const double accelerations[]);

#endif
