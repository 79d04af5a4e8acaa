#include "gated_values.h"

#include <math.h>

#include "logging.h"
#include "observer.h"
#include "scale.h"
#include "settings.h"
#include "tables.h"
#include "values.h"

Status check_arrays(Component *component, const void *references, size_t count, const void *values) {
    if (count == 0 || (references != NULL && values != NULL)) {
        return STATUS_OK;
    }
    return fail(component, "the array of %u %s is NULL", (unsigned)count,
                references == NULL ? "value references" : "values");
}

Status evaluate(Component *component, const Variable *variable) {
    const bool model_exchange = component->type == MODEL_EXCHANGE;
    const bool before = variable->kind == VARIABLE_BELIEF && component->instance.state.phase == PHASE_SOLVING_START;
    if ((before && !observer_begin(&component->instance)) || !value_update(&component->instance, variable->kind)) {
        return report_failure(component, model_exchange ? STATUS_DISCARD : STATUS_ERROR);
    }
    const double value = *value_slot(&component->instance, variable);
    if (isfinite(value)) {
        return STATUS_OK;
    }
    const State *state = &component->instance.state;
    if (tables_explain(&component->instance, state->time, state->states, state->inputs)) {
        return report_failure(component, model_exchange ? STATUS_DISCARD : STATUS_ERROR);
    }
    return (model_exchange ? discard : fail)(
        component, "variable %s is %g at time %.17g; its expression is not defined for the present states and inputs",
        variable->name, value, component->instance.state.time);
}

/* STATUS_OK if a variable of this kind may be set now. Where only importers do it, and the standard does not foresee
   it, the first time is noted. */
static Status check_settable(Component *component, const Variable *variable) {
    const Mode mode = (Mode)component->session.mode;
    const Verdict verdict = legal_set(variable->kind, component->type, mode);
    if (verdict == VERDICT_ILLEGAL && variable->kind == VARIABLE_TIME) {
        return fail(component, "%s is the independent variable; it is changed by " CHANGES_TIME " only",
                    variable->name);
    }
    if (verdict == VERDICT_ILLEGAL && !ever_settable(variable->kind, component->type)) {
        return fail(component, "variable %s is calculated from the others and cannot be set", variable->name);
    }
    if (verdict == VERDICT_ILLEGAL) {
        return fail(component, "variable %s is fixed in state \"%s\"; set it before " EXIT_INITIALIZATION,
                    variable->name, mode_name(mode));
    }
    if (verdict == VERDICT_TOLERATED && !component->noted_kinds[variable->kind]) {
        component->noted_kinds[variable->kind] = true;
        note(component, "setting %s and others of its kind in state \"%s\" is accepted, although the standard does not "
             "foresee it there", variable->name, mode_name(mode));
    }
    return STATUS_OK;
}

Status check_value(Component *component, const Variable *variable, double value) {
    if (check_settable(component, variable) != STATUS_OK) {
        return STATUS_ERROR;
    }
    if (!isfinite(value)) {
        return fail(component, "variable %s cannot be set to %g; expected a finite number", variable->name, value);
    }
    if (value < variable->minimum || value > variable->maximum) {
        return discard(component, "variable %s cannot be set to %.17g; expected a value from %.17g to %.17g, and "
                       "nothing was set", variable->name, value, variable->minimum, variable->maximum);
    }
    if (variable->kind == VARIABLE_SETTING && variable->index == SETTING_TOLERANCE && value > 0.0 &&
        !(value >= LEAST_TOLERANCE && value < 1.0)) {
        return discard(component, "variable %s cannot be set to %g; expected 0, or a value of at least %g, which "
                       "rounding allows, and below 1, and nothing was set", variable->name, value, LEAST_TOLERANCE);
    }
    return STATUS_OK;
}
