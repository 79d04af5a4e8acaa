/* fmi2GetDirectionalDerivative (FMI 2.0, section 2.1.9): dv_unknown = J dv_known for any choice of

       knowns      time, states, inputs, parameters
       unknowns    states, coordinates and velocities without mass, accelerations, locals, dependent parameters

   The derivative of a coordinate has the value reference of its velocity. A velocity is a state, so that its change is
   read from the seed. */
#include <math.h>
#include <string.h>

#include "equations.h"
#include "gate.h"
#include "logging.h"
#include "values.h"

/* Adds the change of a known to the seed; fmi2Error if the variable is no known. */
static fmi2Status add_to_seed(Component *component, Seed *seed, fmi2ValueReference reference, double change) {
    if (reference >= N_VARIABLES) {
        return fail(component, "there is no variable with value reference %u for a known; expected 0 to %d", reference,
                    N_VARIABLES - 1);
    }
    const Variable *variable = &VARIABLES[reference];
    if (!isfinite(change)) {
        return fail(component, "the seed of %s is %g; expected a finite number", variable->name, change);
    }
    double *slot = value_in_seed(seed, variable);
    if (slot == NULL) {
        return fail(component, "variable %s is not a known; expected time, states, inputs and parameters",
                    variable->name);
    }
    *slot += change;
    return fmi2OK;
}

/* fmi2OK if the variable is an unknown. Sets *needs_accelerations if its derivative takes the tangent of the
   accelerations. */
static fmi2Status check_unknown(Component *component, fmi2ValueReference reference, bool *needs_accelerations) {
    if (reference >= N_VARIABLES) {
        return fail(component, "there is no variable with value reference %u for an unknown; expected 0 to %d",
                    reference, N_VARIABLES - 1);
    }
    const Variable *variable = &VARIABLES[reference];
    *needs_accelerations = *needs_accelerations || value_needs_tangent(variable->kind);
    if (value_is_unknown(variable->kind)) {
        return fmi2OK;
    }
    return fail(component, "variable %s is not an unknown; expected derivatives, outputs and calculated variables",
                variable->name);
}

/* Writes the derivatives of the unknowns to values[count] if all of them are finite, else nothing. */
static fmi2Status write_unknowns(Component *component, const fmi2ValueReference unknowns[], size_t count,
                                 const Seed *seed, const Tangent *tangent, double values[]) {
    for (size_t i = 0; i < count; i++) {
        const double value = *value_in_tangent(seed, tangent, &VARIABLES[unknowns[i]]);
        if (!isfinite(value)) {
            return fail(component, "the derivative of %s is %g at time %.17g; it is not defined for the present states "
                        "and inputs", VARIABLES[unknowns[i]].name, value, component->instance.state.time);
        }
    }
    for (size_t i = 0; i < count; i++) {
        values[i] = *value_in_tangent(seed, tangent, &VARIABLES[unknowns[i]]);
    }
    return fmi2OK;
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference vUnknown_ref[], size_t nUnknown,
                                        const fmi2ValueReference vKnown_ref[], size_t nKnown,
                                        const fmi2Real dvKnown[], fmi2Real dvUnknown[]) {
    Component *component = enter_present(c, CALL_GetDirectionalDerivative);
    Seed seed;
    Tangent tangent;
    bool needs_accelerations = false;
    if (component == NULL) {
        return fmi2Error;
    }
    if ((nUnknown > 0 && (vUnknown_ref == NULL || dvUnknown == NULL)) ||
        (nKnown > 0 && (vKnown_ref == NULL || dvKnown == NULL))) {
        return fail(component, "an array is NULL; expected references and values for %u unknowns and %u knowns",
                    (unsigned)nUnknown, (unsigned)nKnown);
    }
    memset(&seed, 0, sizeof seed);
    for (size_t i = 0; i < nKnown; i++) {
        if (add_to_seed(component, &seed, vKnown_ref[i], dvKnown[i]) != fmi2OK) {
            return fmi2Error;
        }
    }
    for (size_t i = 0; i < nUnknown; i++) {
        if (check_unknown(component, vUnknown_ref[i], &needs_accelerations) != fmi2OK) {
            return fmi2Error;
        }
    }
    if (!equations_settle(&component->instance) || !equations_settle_seed(&component->instance, &seed)) {
        return report_failure(component, fmi2Error);
    }
    equations_dependent_tangent(&component->instance, &seed, &tangent);
    if (needs_accelerations && !equations_tangent(&component->instance, &seed, &tangent)) {
        return report_failure(component, fmi2Error);
    }
    return write_unknowns(component, vUnknown_ref, nUnknown, &seed, &tangent, dvUnknown);
}
