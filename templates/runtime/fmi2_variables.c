/* Reading and setting variables (FMI 2.0, section 2.1.7). All variables are of type Real. */
#include <math.h>

#include "equations.h"
#include "instance.h"
#include "integrator.h"
#include "logging.h"

/* Where the value of a variable lives in the instance. */
static double *slot_of(Instance *instance, const Variable *variable) {
    State *state = &instance->state;
    Cache *cache = &instance->cache;
    switch (variable->kind) {
    case VARIABLE_STATE:
    case VARIABLE_MASSLESS:     return &state->states[variable->index];
    case VARIABLE_INPUT:        return &state->inputs[variable->index];
    case VARIABLE_PARAMETER:
    case VARIABLE_FIXED_PARAMETER: return &state->parameters[variable->index];
    case VARIABLE_SETTING:      return &state->settings[variable->index];
    case VARIABLE_ACCELERATION: return &cache->accelerations[variable->index];
    case VARIABLE_MULTIPLIER:   return &cache->reported[N_COORDINATES + variable->index];
    case VARIABLE_DEPENDENT:    return &cache->dependent[variable->index];
    case VARIABLE_LOCAL:        return &cache->locals[variable->index];
    case VARIABLE_TIME:
    case N_VARIABLE_KINDS:      break;
    }
    return &state->time;
}

/* Brings the vector that holds variables of this kind up to date; false if the equations have no solution. */
static bool update(Instance *instance, VariableKind kind) {
    if (kind == VARIABLE_DEPENDENT) {
        equations_dependent(instance);
    }
    if (kind == VARIABLE_MASSLESS) {
        return equations_massless(instance);
    }
    if (kind == VARIABLE_ACCELERATION || kind == VARIABLE_MULTIPLIER) {
        return equations_accelerations(instance);
    }
    return kind != VARIABLE_LOCAL || equations_locals(instance);
}

/* fmi2OK if there is a variable with this value reference. */
static fmi2Status check_reference(Instance *instance, fmi2ValueReference reference) {
    if (reference < N_VARIABLES) {
        return fmi2OK;
    }
    return fail(instance, "there is no Real variable with value reference %u; expected 0 to %d", reference,
                N_VARIABLES - 1);
}

/* fmi2OK if neither array is NULL where it has elements. */
static fmi2Status check_arrays(Instance *instance, const void *references, size_t count, const void *values) {
    if (count == 0 || (references != NULL && values != NULL)) {
        return fmi2OK;
    }
    return fail(instance, "the array of %u %s is NULL", (unsigned)count,
                references == NULL ? "value references" : "values");
}

/* fmi2OK if the variable has a finite value now. Otherwise fmi2Discard in model exchange, so that the importer may try
   a smaller step; in co-simulation the standard leaves fmi2Error only. */
static fmi2Status evaluate(Instance *instance, const Variable *variable) {
    const bool model_exchange = instance->type == fmi2ModelExchange;
    if (!update(instance, variable->kind)) {
        return report_failure(instance, model_exchange ? fmi2Discard : fmi2Error);
    }
    const double value = *slot_of(instance, variable);
    if (isfinite(value)) {
        return fmi2OK;
    }
    return (model_exchange ? discard : fail)(
        instance, "variable %s is %g at time %.17g; its expression is not defined for the present states and inputs",
        variable->name, value, instance->state.time);
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Real value[]) {
    Instance *instance = instance_enter_present(c, CALL_GetReal);
    if (instance == NULL || check_arrays(instance, vr, nvr, value) != fmi2OK) {
        return fmi2Error;
    }
    for (size_t i = 0; i < nvr; i++) {
        if (check_reference(instance, vr[i]) != fmi2OK) {
            return fmi2Error;
        }
    }
    if (!equations_settle(instance)) {
        return report_failure(instance, fmi2Error);
    }
    for (size_t i = 0; i < nvr; i++) {
        const fmi2Status status = evaluate(instance, &VARIABLES[vr[i]]);
        if (status != fmi2OK) {
            return status;
        }
    }
    for (size_t i = 0; i < nvr; i++) {
        value[i] = *slot_of(instance, &VARIABLES[vr[i]]);
    }
    return fmi2OK;
}

/* fmi2OK if a variable of this kind may be set now; notes the first use of a tolerance. */
static fmi2Status check_settable(Instance *instance, const Variable *variable) {
    const Mode mode = (Mode)instance->state.mode;
    const Verdict verdict = legal_set(variable->kind, instance->type, mode);
    if (verdict == VERDICT_ILLEGAL && variable->kind == VARIABLE_TIME) {
        return fail(instance, "%s is the independent variable; it is changed by fmi2DoStep or fmi2SetTime only",
                    variable->name);
    }
    if (verdict == VERDICT_ILLEGAL && !ever_settable(variable->kind, instance->type)) {
        return fail(instance, "variable %s is calculated from the others and cannot be set", variable->name);
    }
    if (verdict == VERDICT_ILLEGAL) {
        return fail(instance, "variable %s is fixed in state \"%s\"; set it before fmi2ExitInitializationMode",
                    variable->name, mode_name(mode));
    }
    if (verdict == VERDICT_TOLERATED && !instance->noted_kinds[variable->kind]) {
        instance->noted_kinds[variable->kind] = true;
        note(instance, "setting %s and others of its kind in state \"%s\" is accepted, although the standard does not "
             "foresee it there", variable->name, mode_name(mode));
    }
    return fmi2OK;
}

/* fmi2OK if the variable may take this value now, fmi2Discard if the value is out of range, else fmi2Error. */
static fmi2Status check_value(Instance *instance, fmi2ValueReference reference, double value) {
    if (check_reference(instance, reference) != fmi2OK) {
        return fmi2Error;
    }
    const Variable *variable = &VARIABLES[reference];
    if (check_settable(instance, variable) != fmi2OK) {
        return fmi2Error;
    }
    if (!isfinite(value)) {
        return fail(instance, "variable %s cannot be set to %g; expected a finite number", variable->name, value);
    }
    if (value < variable->minimum || value > variable->maximum) {
        return discard(instance, "variable %s cannot be set to %.17g; expected a value from %.17g to %.17g, and "
                       "nothing was set", variable->name, value, variable->minimum, variable->maximum);
    }
    if (variable->kind == VARIABLE_SETTING && variable->index == SETTING_TOLERANCE && value > 0.0 &&
        value < LEAST_TOLERANCE) {
        return discard(instance, "variable %s cannot be set to %g, which rounding does not allow; expected 0, or a "
                       "value of at least %g, and nothing was set", variable->name, value, LEAST_TOLERANCE);
    }
    return fmi2OK;
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Real value[]) {
    Instance *instance = instance_enter_present(c, CALL_SetReal);
    if (instance == NULL || check_arrays(instance, vr, nvr, value) != fmi2OK) {
        return fmi2Error;
    }
    for (size_t i = 0; i < nvr; i++) {
        const fmi2Status status = check_value(instance, vr[i], value[i]);
        if (status != fmi2OK) {
            return status;
        }
    }
    for (size_t i = 0; i < nvr; i++) {
        instance_assign(instance, slot_of(instance, &VARIABLES[vr[i]]), value[i]);
    }
    return fmi2OK;
}

/* The common body of the functions for types that no variable has: only empty lists are right. */
static fmi2Status refuse_type(fmi2Component c, Call call, const char *type, size_t nvr) {
    Instance *instance = instance_enter(c, call);
    if (instance == NULL) {
        return fmi2Error;
    }
    return nvr == 0 ? fmi2OK : fail(instance, "this FMU has no variables of type %s; expected none, but got %u", type,
                                    (unsigned)nvr);
}

fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Integer value[]) {
    (void)vr;
    (void)value;
    return refuse_type(c, CALL_GetInteger, "Integer", nvr);
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
    (void)vr;
    (void)value;
    return refuse_type(c, CALL_SetInteger, "Integer", nvr);
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
