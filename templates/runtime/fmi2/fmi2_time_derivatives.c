/* Time derivatives of inputs and outputs in co-simulation (FMI 2.0, section 4.2.1). */
#include <math.h>

#include "equations.h"
#include "inputs.h"
#include "gate.h"
#include "logging.h"
#include "values.h"

/* fmi2OK if the arrays are there, and the references and orders are those of variables. */
static fmi2Status check_arguments(Component *component, const fmi2ValueReference vr[], size_t nvr,
                                  const fmi2Integer order[], const void *value, int highest) {
    if (nvr > 0 && (vr == NULL || order == NULL || value == NULL)) {
        return fail(component, "an array is NULL; expected references, orders and values of %u derivatives",
                    (unsigned)nvr);
    }
    for (size_t i = 0; i < nvr; i++) {
        if (vr[i] >= N_VARIABLES || value_is_integer(VARIABLES[vr[i]].kind)) {
            return fail(component, "there is no Real variable with value reference %u; expected 0 to %d", vr[i],
                        N_VARIABLES - 1);
        }
        if (order[i] < 1 || order[i] > highest) {
            return fail(component, "the order of the derivative of %s is %d; expected 1 to %d", VARIABLES[vr[i]].name,
                        (int)order[i], highest);
        }
    }
    return fmi2OK;
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                       const fmi2Integer order[], const fmi2Real value[]) {
    Component *component = enter_present(c, CALL_SetRealInputDerivatives);
    if (component == NULL || check_arguments(component, vr, nvr, order, value, MAX_INPUT_ORDER) != fmi2OK) {
        return fmi2Error;
    }
    for (size_t i = 0; i < nvr; i++) {
        const Variable *variable = &VARIABLES[vr[i]];
        if (variable->kind != VARIABLE_INPUT) {
            return fail(component, "variable %s is not an input; only inputs have derivatives that can be set",
                        variable->name);
        }
        if (!isfinite(value[i])) {
            return fail(component, "the derivative of order %d of %s cannot be set to %g; expected a finite number",
                        (int)order[i], variable->name, value[i]);
        }
    }
    for (size_t i = 0; i < nvr; i++) {
        inputs_set_derivative(&component->instance, VARIABLES[vr[i]].index, order[i], value[i]);
    }
    return fmi2OK;
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                        const fmi2Integer order[], fmi2Real value[]) {
    Component *component = enter_present(c, CALL_GetRealOutputDerivatives);
    Motion motion;
    int needed = -1;
    if (component == NULL || check_arguments(component, vr, nvr, order, value, MAX_OUTPUT_ORDER) != fmi2OK) {
        return fmi2Error;
    }
    for (size_t i = 0; i < nvr; i++) {
        const Variable *variable = &VARIABLES[vr[i]];
        if (!variable->output) {
            return fail(component, "variable %s is not an output; only outputs have derivatives that can be read",
                        variable->name);
        }
        const int order_needed = value_motion_order(variable, order[i]);
        needed = order_needed > needed ? order_needed : needed;
    }
    Instance *instance = &component->instance;
    if (nvr > 0 && !(equations_settle(instance) && equations_motion(instance, needed, &motion))) {
        return report_failure(component, fmi2Error);
    }
    for (size_t i = 0; i < nvr; i++) {
        const double derivative = value_in_motion(&motion, &VARIABLES[vr[i]], order[i]);
        if (!isfinite(derivative)) {
            return fail(component, "the derivative of order %d of %s is %g at time %.17g; it is not defined for the "
                        "present states and inputs", (int)order[i], VARIABLES[vr[i]].name, derivative,
                        component->instance.state.time);
        }
    }
    for (size_t i = 0; i < nvr; i++) {
        value[i] = value_in_motion(&motion, &VARIABLES[vr[i]], order[i]);
    }
    return fmi2OK;
}
