/* How solver steps fail. */
#ifndef STEP_FAILURE_H
#define STEP_FAILURE_H

#include "solver.h"

/* Sets instance->failure to equations of an implicit step that were not solved; returns false. */
bool report_iteration(Instance *instance, Step step);

/* Are the new states in scratch finite? If not, sets instance->failure. */
bool new_states_finite(Instance *instance, Step step);

#endif
