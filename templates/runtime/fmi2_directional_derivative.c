/* fmi2GetDirectionalDerivative (FMI 2.0, section 2.1.9): dv_unknown = J dv_known for any choice of

       knowns      time, states, inputs, parameters
       unknowns    states and what has no mass, accelerations, locals, dependent parameters

   The derivative of a coordinate has the value reference of its velocity, which is a state: its row is the seed's. */
#include <math.h>
#include <string.h>

#include "equations.h"
#include "instance.h"
#include "logging.h"

/* Adds a known's component to the seed; fmi2Error if the variable is no known. */
static fmi2Status add_to_seed(Instance *instance, Seed *seed, fmi2ValueReference reference, double component) {
    if (reference >= N_VARIABLES) {
        return fail(instance, "there is no variable with value reference %u for a known; expected 0 to %d", reference,
                    N_VARIABLES - 1);
    }
    const Variable *variable = &VARIABLES[reference];
    if (!isfinite(component)) {
        return fail(instance, "the seed of %s is %g; expected a finite number", variable->name, component);
    }
    switch (variable->kind) {
    case VARIABLE_TIME:      seed->time += component; return fmi2OK;
    case VARIABLE_STATE:     seed->states[variable->index] += component; return fmi2OK;
    case VARIABLE_INPUT:     seed->inputs[variable->index] += component; return fmi2OK;
    case VARIABLE_FIXED_PARAMETER:
    case VARIABLE_PARAMETER: seed->parameters[variable->index] += component; return fmi2OK;
    default: break;
    }
    return fail(instance, "variable %s is not a known; expected time, states, inputs and parameters", variable->name);
}

/* fmi2OK if the variable is an unknown; tells whether the accelerations' tangent is needed for it. */
static fmi2Status check_unknown(Instance *instance, fmi2ValueReference reference, bool *needs_accelerations) {
    if (reference >= N_VARIABLES) {
        return fail(instance, "there is no variable with value reference %u for an unknown; expected 0 to %d",
                    reference, N_VARIABLES - 1);
    }
    const VariableKind kind = VARIABLES[reference].kind;
    const bool calculated = kind == VARIABLE_ACCELERATION || kind == VARIABLE_MULTIPLIER || kind == VARIABLE_LOCAL;
    *needs_accelerations = *needs_accelerations || calculated;
    if (kind == VARIABLE_STATE || kind == VARIABLE_MASSLESS || kind == VARIABLE_DEPENDENT || calculated) {
        return fmi2OK;
    }
    return fail(instance, "variable %s is not an unknown; expected derivatives, outputs and calculated variables",
                VARIABLES[reference].name);
}

/* The derivative of an unknown along the seed. */
static double component_of(const Variable *variable, const Seed *seed, const Tangent *tangent) {
    switch (variable->kind) {
    case VARIABLE_ACCELERATION: return tangent->accelerations[variable->index];
    case VARIABLE_MULTIPLIER:   return tangent->accelerations[N_COORDINATES + variable->index];
    case VARIABLE_DEPENDENT:    return tangent->dependent[variable->index];
    case VARIABLE_LOCAL:        return tangent->locals[variable->index];
    default:                    return seed->states[variable->index];
    }
}

/* Writes the derivatives of the unknowns, if all are finite. */
static fmi2Status write_unknowns(Instance *instance, const fmi2ValueReference unknowns[], size_t count,
                                 const Seed *seed, const Tangent *tangent, double values[]) {
    for (size_t i = 0; i < count; i++) {
        const double value = component_of(&VARIABLES[unknowns[i]], seed, tangent);
        if (!isfinite(value)) {
            return fail(instance, "the derivative of %s is %g at time %.17g; it is not defined for the present states "
                        "and inputs", VARIABLES[unknowns[i]].name, value, instance->state.time);
        }
    }
    for (size_t i = 0; i < count; i++) {
        values[i] = component_of(&VARIABLES[unknowns[i]], seed, tangent);
    }
    return fmi2OK;
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference vUnknown_ref[], size_t nUnknown,
                                        const fmi2ValueReference vKnown_ref[], size_t nKnown,
                                        const fmi2Real dvKnown[], fmi2Real dvUnknown[]) {
    Instance *instance = instance_enter_present(c, CALL_GetDirectionalDerivative);
    Seed seed;
    Tangent tangent;
    bool needs_accelerations = false;
    if (instance == NULL) {
        return fmi2Error;
    }
    if ((nUnknown > 0 && (vUnknown_ref == NULL || dvUnknown == NULL)) ||
        (nKnown > 0 && (vKnown_ref == NULL || dvKnown == NULL))) {
        return fail(instance, "an array is NULL; expected references and values for %u unknowns and %u knowns",
                    (unsigned)nUnknown, (unsigned)nKnown);
    }
    memset(&seed, 0, sizeof seed);
    for (size_t i = 0; i < nKnown; i++) {
        if (add_to_seed(instance, &seed, vKnown_ref[i], dvKnown[i]) != fmi2OK) {
            return fmi2Error;
        }
    }
    for (size_t i = 0; i < nUnknown; i++) {
        if (check_unknown(instance, vUnknown_ref[i], &needs_accelerations) != fmi2OK) {
            return fmi2Error;
        }
    }
    if (!equations_settle(instance) || !equations_settle_seed(instance, &seed)) {
        return report_failure(instance, fmi2Error);
    }
    equations_dependent_tangent(instance, &seed, &tangent);
    if (needs_accelerations && !equations_tangent(instance, &seed, &tangent)) {
        return report_failure(instance, fmi2Error);
    }
    return write_unknowns(instance, vUnknown_ref, nUnknown, &seed, &tangent, dvUnknown);
}
