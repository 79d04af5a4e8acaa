#include "output_derivatives.h"

#include <math.h>

#include "equations.h"
#include "logging.h"
#include "values.h"

Status check_order(Component *component, const Variable *variable, int order, int highest) {
    if (order < 1 || order > highest) {
        return fail(component, "the order of the derivative of %s is %d; expected 1 to %d", variable->name, order,
                    highest);
    }
    return STATUS_OK;
}

Status check_output(Component *component, const Variable *variable, int order, int *needed) {
    if (check_order(component, variable, order, MAX_OUTPUT_ORDER) != STATUS_OK) {
        return STATUS_ERROR;
    }
    if (OBSERVES) {
        return fail(component, "an FMU that observes has no derivatives of outputs, such as %s", variable->name);
    }
    if (!variable->output) {
        return fail(component, "variable %s is not an output; only outputs have derivatives that can be read",
                    variable->name);
    }
    const int order_needed = value_motion_order(variable, order);
    *needed = order_needed > *needed ? order_needed : *needed;
    return STATUS_OK;
}

Status find_motion(Component *component, int needed, Motion *motion) {
    Instance *instance = &component->instance;
    if (!equations_settle(instance) || !equations_motion(instance, needed, motion)) {
        return report_failure(component, STATUS_ERROR);
    }
    equations_locals_motion(instance, needed, motion);
    return STATUS_OK;
}

Status read_motion(Component *component, const Motion *motion, const Variable *variable, int order, double *value) {
    *value = value_in_motion(motion, variable, order);
    if (!isfinite(*value)) {
        return fail(component, "the derivative of order %d of %s is %g at time %.17g; it is not defined for the "
                    "present states and inputs", order, variable->name, *value, component->instance.state.time);
    }
    return STATUS_OK;
}
