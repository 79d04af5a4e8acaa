#include "gated_derivatives.h"

#include <math.h>

#include "equations.h"
#include "logging.h"
#include "values.h"

Status check_known(Component *component, const Variable *variable) {
    if (value_in_seed(&component->seed, variable) == NULL) {
        return fail(component, "variable %s is not a known; expected time, states, inputs and parameters",
                    variable->name);
    }
    return STATUS_OK;
}

Status add_to_seed(Component *component, Seed *seed, const Variable *variable, double change) {
    if (!isfinite(change)) {
        return fail(component, "the seed of %s is %g; expected a finite number", variable->name, change);
    }
    if (check_known(component, variable) != STATUS_OK) {
        return STATUS_ERROR;
    }
    *value_in_seed(seed, variable) += change;
    return STATUS_OK;
}

Status check_unknown(Component *component, const Variable *variable, int *needed) {
    const int order = value_tangent_order(variable->kind);
    *needed = order > *needed ? order : *needed;
    if (value_is_unknown(variable->kind)) {
        return STATUS_OK;
    }
    return fail(component, "variable %s is not an unknown; expected derivatives, outputs and calculated variables",
                variable->name);
}

Status find_tangent(Component *component, Seed *seed, int needed, Tangent *tangent) {
    Instance *instance = &component->instance;
    if (!equations_settle(instance) || !equations_settle_seed(instance, seed)) {
        return report_failure(component, STATUS_ERROR);
    }
    equations_dependent_tangent(instance, seed, tangent);
    if (needed > 0 && !equations_tangent(instance, seed, tangent)) {
        return report_failure(component, STATUS_ERROR);
    }
    if (needed > 1) {
        equations_locals_tangent(instance, seed, tangent);
    }
    return STATUS_OK;
}

Status read_tangent(Component *component, const Seed *seed, const Tangent *tangent, const Variable *variable,
                    double *value) {
    *value = *value_in_tangent(seed, tangent, variable);
    if (!isfinite(*value)) {
        return fail(component, "the derivative of %s is %g at time %.17g; it is not defined for the present states "
                    "and inputs", variable->name, *value, component->instance.state.time);
    }
    return STATUS_OK;
}
