/* Why an evaluation or a solver step failed, as data. */
#ifndef FAILURE_H
#define FAILURE_H

#include "instance.h"

/* These set instance->failure to this kind at this time (s), about an event function by its index, or a constraint by
   its own. They return false. What the amount is depends on the kind, see Failure. */
bool report_amount(Instance *instance, FailureKind kind, double time, double amount);
bool report_event(Instance *instance, FailureKind kind, double time, int event);
bool report_constraint(Instance *instance, FailureKind kind, double time, int constraint, double amount);

/* Sets instance->failure to this kind at this time, flagging coordinates[n]; returns false. */
bool report_coordinates(Instance *instance, FailureKind kind, double time, const bool coordinates[]);

/* Sets instance->failure to these accelerations[n] at this time, which are not all finite; returns false. */
bool report_accelerations(Instance *instance, double time, const double accelerations[]);

#endif
