#include "settings.h"

#include <math.h>

/* Relative; that of fmpy and most importers. */
static const double DEFAULT_TOLERANCE = 1e-6;

double solver_tolerance(const State *state) {
    const double setting = state->settings[SETTING_TOLERANCE];
    const double importer = state->tolerance > 0.0 ? state->tolerance : DEFAULT_TOLERANCE;
    return setting > 0.0 ? setting : importer;
}

double experiment_duration(const State *state) {
    const double span = state->stop_time_defined ? state->stop_time - state->start_time : 0.0;
    return span > 0.0 && isfinite(span) ? span : DEFAULT_DURATION;
}
