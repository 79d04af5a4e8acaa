#include "communication_step.h"

#include <float.h>
#include <math.h>
#include <stdio.h>

#include "scale.h"

/* 64 units in the last place of a time. */
static double rounding(double time) {
    return 64.0 * DBL_EPSILON * fabs(time);
}

bool communication_step_possible(const Instance *instance, double point, double step, char text[], size_t size) {
    const State *state = &instance->state;
    if (!(step > 0.0) || !isfinite(step)) {
        snprintf(text, size, "the communication step is %.17g s; expected a positive number", step);
        return false;
    }
    if (!(fabs(point - state->time) <= COMMUNICATION_POINT * step + rounding(state->time))) {
        snprintf(text, size, "the communication point is %.17g s; expected the end of the last step, %.17g s, to "
                 "within %g of the communication step %.17g s", point, state->time, COMMUNICATION_POINT,
                 step);
        return false;
    }
    if (!isfinite(point + step)) {
        snprintf(text, size, "the communication step from %.17g s by %.17g s has no finite end", point, step);
        return false;
    }
    if (state->stop_time_defined &&
        point + step > state->stop_time + SLIVER * step + rounding(state->stop_time)) {
        snprintf(text, size, "the communication step would end at %.17g s; expected no time after the stop time %.17g "
                 "s that the experiment was set up with", point + step, state->stop_time);
        return false;
    }
    return true;
}
