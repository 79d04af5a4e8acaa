/* fmi2GetDirectionalDerivative (FMI 2.0, section 2.1.9): dv_unknown = J dv_known. The derivative of a coordinate has
   the value reference of its velocity. */
#include <string.h>

#include "gated_derivatives.h"
#include "logging.h"

/* fmi2OK if the value references are those of variables, which are called what in sentences. */
static fmi2Status check_references(Component *component, const fmi2ValueReference references[], size_t count,
                                   const char *what) {
    for (size_t i = 0; i < count; i++) {
        if (references[i] >= N_VARIABLES) {
            return fail(component, "there is no variable with value reference %u for %s; expected 0 to %d",
                        references[i], what, N_VARIABLES - 1);
        }
    }
    return fmi2OK;
}

/* Makes the seed of the changes of the knowns, and looks at the unknowns. */
static fmi2Status prepare_columns(Component *component, const fmi2ValueReference unknowns[], size_t n_unknowns,
                          const fmi2ValueReference knowns[], size_t n_knowns, const double changes[], Seed *seed,
                          int *needed) {
    if (check_references(component, knowns, n_knowns, "a known") != fmi2OK ||
        check_references(component, unknowns, n_unknowns, "an unknown") != fmi2OK) {
        return fmi2Error;
    }
    memset(seed, 0, sizeof *seed);
    for (size_t i = 0; i < n_knowns; i++) {
        if (add_to_seed(component, seed, &VARIABLES[knowns[i]], changes[i]) != fmi2OK) {
            return fmi2Error;
        }
    }
    for (size_t i = 0; i < n_unknowns; i++) {
        if (check_unknown(component, &VARIABLES[unknowns[i]], needed) != fmi2OK) {
            return fmi2Error;
        }
    }
    return fmi2OK;
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference vUnknown_ref[], size_t nUnknown,
                                        const fmi2ValueReference vKnown_ref[], size_t nKnown,
                                        const fmi2Real dvKnown[], fmi2Real dvUnknown[]) {
    Component *component = enter_present(c, CALL_GetDirectionalDerivative);
    int needed = 0;
    double value;
    if (component == NULL) {
        return fmi2Error;
    }
    if ((nUnknown > 0 && (vUnknown_ref == NULL || dvUnknown == NULL)) ||
        (nKnown > 0 && (vKnown_ref == NULL || dvKnown == NULL))) {
        return fail(component, "an array is NULL; expected references and values for %u unknowns and %u knowns",
                    (unsigned)nUnknown, (unsigned)nKnown);
    }
    Seed *seed = &component->seed;
    Tangent *tangent = &component->tangent;
    if (prepare_columns(component, vUnknown_ref, nUnknown, vKnown_ref, nKnown, dvKnown, seed, &needed) !=
            fmi2OK ||
        find_tangent(component, seed, needed, tangent) != fmi2OK) {
        return fmi2Error;
    }
    for (size_t i = 0; i < nUnknown; i++) {
        if (read_tangent(component, seed, tangent, &VARIABLES[vUnknown_ref[i]], &value) != fmi2OK) {
            return fmi2Error;
        }
    }
    for (size_t i = 0; i < nUnknown; i++) {
        read_tangent(component, seed, tangent, &VARIABLES[vUnknown_ref[i]], &dvUnknown[i]);
    }
    return fmi2OK;
}
