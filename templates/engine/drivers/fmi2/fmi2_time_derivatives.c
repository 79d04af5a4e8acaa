/* Time derivatives of inputs and outputs in co-simulation (FMI 2.0, section 4.2.1). */
#include <math.h>

#include "inputs.h"
#include "logging.h"
#include "output_derivatives.h"
#include "values.h"

/* fmi2OK if the arrays are there, and the references are those of Real variables. */
static fmi2Status check_arguments(Component *component, const fmi2ValueReference vr[], size_t nvr,
                                  const fmi2Integer order[], const void *value) {
    if (nvr > 0 && (vr == NULL || order == NULL || value == NULL)) {
        return fail(component, "an array is NULL; expected references, orders and values of %u derivatives",
                    (unsigned)nvr);
    }
    for (size_t i = 0; i < nvr; i++) {
        if (vr[i] >= N_VARIABLES || value_is_integer(VARIABLES[vr[i]].kind)) {
            return fail(component, "there is no Real variable with value reference %u; expected 0 to %d", vr[i],
                        N_VARIABLES - 1);
        }
    }
    return fmi2OK;
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                       const fmi2Integer order[], const fmi2Real value[]) {
    Component *component = enter_present(c, CALL_SetRealInputDerivatives);
    if (component == NULL || check_arguments(component, vr, nvr, order, value) != fmi2OK) {
        return fmi2Error;
    }
    for (size_t i = 0; i < nvr; i++) {
        const Variable *variable = &VARIABLES[vr[i]];
        if (check_order(component, variable, order[i], MAX_INPUT_ORDER) != fmi2OK) {
            return fmi2Error;
        }
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
    int needed = -1;
    double derivative;
    if (component == NULL || check_arguments(component, vr, nvr, order, value) != fmi2OK) {
        return fmi2Error;
    }
    for (size_t i = 0; i < nvr; i++) {
        if (check_output(component, &VARIABLES[vr[i]], order[i], &needed) != fmi2OK) {
            return fmi2Error;
        }
    }
    if (nvr > 0 && find_motion(component, needed, &component->motion) != fmi2OK) {
        return fmi2Error;
    }
    for (size_t i = 0; i < nvr; i++) {
        if (read_motion(component, &component->motion, &VARIABLES[vr[i]], order[i], &derivative) != fmi2OK) {
            return fmi2Error;
        }
    }
    for (size_t i = 0; i < nvr; i++) {
        read_motion(component, &component->motion, &VARIABLES[vr[i]], order[i], &value[i]);
    }
    return fmi2OK;
}
