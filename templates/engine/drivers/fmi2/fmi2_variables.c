/* Reading and setting variables (FMI 2.0, section 2.1.7). Variables are of type Real; modes and counts of
   contacts are Integers, which can be read only. */
#include <math.h>

#include "equations.h"
#include "gated_values.h"
#include "logging.h"
#include "values.h"

/* fmi2OK if there is a variable of this type with this value reference. */
static fmi2Status check_type(Component *component, fmi2ValueReference reference, bool integer) {
    const char *type = integer ? "Integer" : "Real";
    if (reference >= N_VARIABLES) {
        return fail(component, "there is no %s variable with value reference %u; expected 0 to %d", type, reference,
                    N_VARIABLES - 1);
    }
    if (value_is_integer(VARIABLES[reference].kind) != integer) {
        return fail(component, "variable %s is not of type %s; read it by fmi2Get%s", VARIABLES[reference].name, type,
                    integer ? "Real" : "Integer");
    }
    return fmi2OK;
}

/* fmi2OK if there is a Real variable with this value reference. */
static fmi2Status check_reference(Component *component, fmi2ValueReference reference) {
    return check_type(component, reference, false);
}

/* Is this a reference of the kind that controllers read or set in each step? */
static bool is_of(VariableKind kind, fmi2ValueReference reference) {
    return reference < N_VARIABLES && VARIABLES[reference].kind == kind;
}

/* Reads states alone, which are finite. False: there are others among the variables. */
static bool read_states(const Instance *instance, const fmi2ValueReference vr[], size_t nvr, fmi2Real value[]) {
    bool states = instance->state.phase == PHASE_RUNNING;
    for (size_t i = 0; i < nvr && states; i++) {
        states = is_of(VARIABLE_STATE, vr[i]);
        if (states) {
            value[i] = instance->state.states[VARIABLES[vr[i]].index];
            states = isfinite(value[i]);
        }
    }
    return states;
}

/* Sets inputs alone. False, and nothing is set: there are others among the variables, or it is not allowed. */
static bool write_inputs(Component *component, const fmi2ValueReference vr[], size_t nvr, const fmi2Real value[]) {
    Instance *instance = &component->instance;
    bool inputs = legal_set(VARIABLE_INPUT, component->type, (Mode)component->session.mode) == VERDICT_LEGAL;
    for (size_t i = 0; i < nvr && inputs; i++) {
        inputs = is_of(VARIABLE_INPUT, vr[i]) && isfinite(value[i]) && value[i] >= VARIABLES[vr[i]].minimum &&
                 value[i] <= VARIABLES[vr[i]].maximum;
    }
    for (size_t i = 0; i < nvr && inputs; i++) {
        instance_assign(instance, &instance->state.inputs[VARIABLES[vr[i]].index], value[i]);
    }
    return inputs;
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Real value[]) {
    Component *component = enter_present(c, CALL_GetReal);
    if (component == NULL || check_arrays(component, vr, nvr, value) != fmi2OK) {
        return fmi2Error;
    }
    if (read_states(&component->instance, vr, nvr, value)) {
        return fmi2OK;
    }
    for (size_t i = 0; i < nvr; i++) {
        if (check_reference(component, vr[i]) != fmi2OK) {
            return fmi2Error;
        }
    }
    if (!equations_settle(&component->instance)) {
        return report_failure(component, fmi2Error);
    }
    for (size_t i = 0; i < nvr; i++) {
        const fmi2Status status = evaluate(component, &VARIABLES[vr[i]]);
        if (status != fmi2OK) {
            return status;
        }
    }
    for (size_t i = 0; i < nvr; i++) {
        value[i] = *value_slot(&component->instance, &VARIABLES[vr[i]]);
    }
    return fmi2OK;
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Real value[]) {
    Component *component = enter_present(c, CALL_SetReal);
    if (component == NULL || check_arrays(component, vr, nvr, value) != fmi2OK) {
        return fmi2Error;
    }
    if (write_inputs(component, vr, nvr, value)) {
        return fmi2OK;
    }
    for (size_t i = 0; i < nvr; i++) {
        const fmi2Status status = check_reference(component, vr[i]);
        const fmi2Status verdict = status != fmi2OK ? status : check_value(component, &VARIABLES[vr[i]], value[i]);
        if (verdict != fmi2OK) {
            return verdict;
        }
    }
    for (size_t i = 0; i < nvr; i++) {
        instance_assign(&component->instance, value_slot(&component->instance, &VARIABLES[vr[i]]), value[i]);
    }
    return fmi2OK;
}

/* Has the FMU variables of type Integer? */
static bool has_integers(void) {
    return N_UNILATERALS + N_FRICTIONS > 0;
}

/* The common body of the functions for types that no variable has: an empty list is the only right one. */
static fmi2Status refuse_type(fmi2Component c, Call call, const char *type, size_t nvr) {
    Component *component = enter(c, call);
    if (component == NULL) {
        return fmi2Error;
    }
    return nvr == 0 ? fmi2OK : fail(component, "this FMU has no variables of type %s; expected none, but got %u", type,
                                    (unsigned)nvr);
}

/* No Integer can be set; says so of the variable with this value reference. */
static fmi2Status refuse_integer(Component *component, fmi2ValueReference reference) {
    if (check_type(component, reference, true) != fmi2OK) {
        return fmi2Error;
    }
    return fail(component, "variable %s is calculated from the others and cannot be set", VARIABLES[reference].name);
}

fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Integer value[]) {
    if (!has_integers()) {
        return refuse_type(c, CALL_GetInteger, "Integer", nvr);
    }
    Component *component = enter_present(c, CALL_GetInteger);
    if (component == NULL || check_arrays(component, vr, nvr, value) != fmi2OK) {
        return fmi2Error;
    }
    for (size_t i = 0; i < nvr; i++) {
        if (check_type(component, vr[i], true) != fmi2OK) {
            return fmi2Error;
        }
    }
    if (!equations_settle(&component->instance)) {
        return report_failure(component, fmi2Error);
    }
    for (size_t i = 0; i < nvr; i++) {
        value[i] = value_integer(&component->instance, &VARIABLES[vr[i]]);
    }
    return fmi2OK;
}

fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Boolean value[]) {
    (void)vr;
    (void)value;
    return refuse_type(c, CALL_GetBoolean, "Boolean", nvr);
}

fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2String value[]) {
    (void)vr;
    (void)value;
    return refuse_type(c, CALL_GetString, "String", nvr);
}

fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Integer value[]) {
    if (!has_integers()) {
        return refuse_type(c, CALL_SetInteger, "Integer", nvr);
    }
    Component *component = enter(c, CALL_SetInteger);
    if (component == NULL || check_arrays(component, vr, nvr, value) != fmi2OK) {
        return fmi2Error;
    }
    return nvr == 0 ? fmi2OK : refuse_integer(component, vr[0]);
}

fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Boolean value[]) {
    (void)vr;
    (void)value;
    return refuse_type(c, CALL_SetBoolean, "Boolean", nvr);
}

fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2String value[]) {
    (void)vr;
    (void)value;
    return refuse_type(c, CALL_SetString, "String", nvr);
}
