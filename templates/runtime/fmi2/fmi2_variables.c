/* Reading and setting variables (FMI 2.0, section 2.1.7). Variables are of type Real; modes and counts of
   contacts are Integers, which can be read only. */
#include <math.h>

#include "equations.h"
#include "gate.h"
#include "logging.h"
#include "settings.h"
#include "tables.h"
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

/* fmi2OK if neither array is NULL where it has elements. */
static fmi2Status check_arrays(Component *component, const void *references, size_t count, const void *values) {
    if (count == 0 || (references != NULL && values != NULL)) {
        return fmi2OK;
    }
    return fail(component, "the array of %u %s is NULL", (unsigned)count,
                references == NULL ? "value references" : "values");
}

/* fmi2OK if the variable has a finite value now. Otherwise fmi2Discard in model exchange, so that the importer may try
   a smaller step; in co-simulation the standard leaves fmi2Error only. */
static fmi2Status evaluate(Component *component, const Variable *variable) {
    const bool model_exchange = component->type == fmi2ModelExchange;
    if (!value_update(&component->instance, variable->kind)) {
        return report_failure(component, model_exchange ? fmi2Discard : fmi2Error);
    }
    const double value = *value_slot(&component->instance, variable);
    if (isfinite(value)) {
        return fmi2OK;
    }
    const State *state = &component->instance.state;
    if (tables_explain(&component->instance, state->time, state->states, state->inputs)) {
        return report_failure(component, model_exchange ? fmi2Discard : fmi2Error);
    }
    return (model_exchange ? discard : fail)(
        component, "variable %s is %g at time %.17g; its expression is not defined for the present states and inputs",
        variable->name, value, component->instance.state.time);
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Real value[]) {
    Component *component = enter_present(c, CALL_GetReal);
    if (component == NULL || check_arrays(component, vr, nvr, value) != fmi2OK) {
        return fmi2Error;
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

/* fmi2OK if a variable of this kind may be set now. Where only importers do it, and the standard does not foresee it,
   the first time is noted. */
static fmi2Status check_settable(Component *component, const Variable *variable) {
    const Mode mode = (Mode)component->session.mode;
    const Verdict verdict = legal_set(variable->kind, component->type, mode);
    if (verdict == VERDICT_ILLEGAL && variable->kind == VARIABLE_TIME) {
        return fail(component, "%s is the independent variable; it is changed by fmi2DoStep or fmi2SetTime only",
                    variable->name);
    }
    if (verdict == VERDICT_ILLEGAL && !ever_settable(variable->kind, component->type)) {
        return fail(component, "variable %s is calculated from the others and cannot be set", variable->name);
    }
    if (verdict == VERDICT_ILLEGAL) {
        return fail(component, "variable %s is fixed in state \"%s\"; set it before fmi2ExitInitializationMode",
                    variable->name, mode_name(mode));
    }
    if (verdict == VERDICT_TOLERATED && !component->noted_kinds[variable->kind]) {
        component->noted_kinds[variable->kind] = true;
        note(component, "setting %s and others of its kind in state \"%s\" is accepted, although the standard does not "
             "foresee it there", variable->name, mode_name(mode));
    }
    return fmi2OK;
}

/* fmi2OK if the variable may take this value now, fmi2Discard if the value is out of range, else fmi2Error. */
static fmi2Status check_value(Component *component, fmi2ValueReference reference, double value) {
    if (check_reference(component, reference) != fmi2OK) {
        return fmi2Error;
    }
    const Variable *variable = &VARIABLES[reference];
    if (check_settable(component, variable) != fmi2OK) {
        return fmi2Error;
    }
    if (!isfinite(value)) {
        return fail(component, "variable %s cannot be set to %g; expected a finite number", variable->name, value);
    }
    if (value < variable->minimum || value > variable->maximum) {
        return discard(component, "variable %s cannot be set to %.17g; expected a value from %.17g to %.17g, and "
                       "nothing was set", variable->name, value, variable->minimum, variable->maximum);
    }
    if (variable->kind == VARIABLE_SETTING && variable->index == SETTING_TOLERANCE && value > 0.0 &&
        value < LEAST_TOLERANCE) {
        return discard(component, "variable %s cannot be set to %g, which rounding does not allow; expected 0, or a "
                       "value of at least %g, and nothing was set", variable->name, value, LEAST_TOLERANCE);
    }
    return fmi2OK;
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Real value[]) {
    Component *component = enter_present(c, CALL_SetReal);
    if (component == NULL || check_arrays(component, vr, nvr, value) != fmi2OK) {
        return fmi2Error;
    }
    for (size_t i = 0; i < nvr; i++) {
        const fmi2Status status = check_value(component, vr[i], value[i]);
        if (status != fmi2OK) {
            return status;
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
