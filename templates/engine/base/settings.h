/* What the user and the importer ask of the solver; a setting of the user that is not 0 wins. */
#ifndef SETTINGS_H
#define SETTINGS_H

#include "state.h"

/* The relative tolerance: solver_tolerance if given, else that of the importer if given, else 1e-6. */
double solver_tolerance(const State *state);

/* s: that of the experiment of the importer, if it has an end, else that of the default experiment. */
double experiment_duration(const State *state);

#endif
