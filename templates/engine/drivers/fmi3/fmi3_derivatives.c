/* fmi3GetDirectionalDerivative: sensitivity = J seed, and fmi3GetAdjointDerivative: sensitivity = J^T seed (FMI 3.0,
   section 2.2.12). */
#include <math.h>
#include <string.h>

#include "adjoint.h"
#include "gated_derivatives.h"
#include "logging.h"
#include "port_access.h"
#include "values.h"

/* fmi3OK if these are references of real variables, whose seeds or sensitivities the values are. */
static fmi3Status check_lists(Component *component, const fmi3ValueReference unknowns[], size_t n_unknowns,
                              const fmi3ValueReference knowns[], size_t n_knowns, const double of_unknowns[],
                              size_t n_of_unknowns, const double of_knowns[], size_t n_of_knowns) {
    const bool fit = check_ports(component, unknowns, n_unknowns, &FLOAT64, of_unknowns, n_of_unknowns) == fmi3OK &&
                     check_ports(component, knowns, n_knowns, &FLOAT64, of_knowns, n_of_knowns) == fmi3OK;
    return fit ? check_first(component, knowns, n_knowns, "is not a known") : fmi3Error;
}

/* Writes the derivatives of the unknowns along the seed, if all of them are finite. */
static fmi3Status write_tangent(Component *component, const Seed *seed, const Tangent *tangent,
                                const fmi3ValueReference unknowns[], double values[], size_t count) {
    Elements elements = elements_of(unknowns), again = elements;
    double value;
    for (size_t i = 0; i < count; i++) {
        if (read_tangent(component, seed, tangent, next_element(&elements), &value) != fmi3OK) {
            return fmi3Error;
        }
    }
    for (size_t i = 0; i < count; i++) {
        read_tangent(component, seed, tangent, next_element(&again), &values[i]);
    }
    return fmi3OK;
}

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[], size_t nUnknowns,
                                        const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[],
                                        size_t nSeed, fmi3Float64 sensitivity[], size_t nSensitivity) {
    Component *component = enter_present(instance, CALL_GetDirectionalDerivative);
    int needed = 0;
    if (component == NULL || check_lists(component, unknowns, nUnknowns, knowns, nKnowns, sensitivity, nSensitivity,
                                         seed, nSeed) != fmi3OK) {
        return fmi3Error;
    }
    Elements known = elements_of(knowns), unknown = elements_of(unknowns);
    Seed *direction = &component->seed;
    Tangent *tangent = &component->tangent;
    memset(direction, 0, sizeof *direction);
    for (size_t i = 0; i < nSeed; i++) {
        if (add_to_seed(component, direction, next_element(&known), seed[i]) != fmi3OK) {
            return fmi3Error;
        }
    }
    for (size_t i = 0; i < nSensitivity; i++) {
        if (check_unknown(component, next_element(&unknown), &needed) != fmi3OK) {
            return fmi3Error;
        }
    }
    return find_tangent(component, direction, needed, tangent) != fmi3OK
               ? fmi3Error
               : write_tangent(component, direction, tangent, unknowns, sensitivity, nSensitivity);
}

/* Adds the weight of an unknown. */
static fmi3Status add_weight(Component *component, Tangent *weights, Seed *sensitivity, const Variable *variable,
                             double weight) {
    int needed = 0; /* nobody asks */
    if (check_unknown(component, variable, &needed) != fmi3OK) {
        return fmi3Error;
    }
    if (!isfinite(weight)) {
        return fail(component, "the seed of %s is %g; expected a finite number", variable->name, weight);
    }
    double *slot = adjoint_weight(weights, sensitivity, variable);
    if (slot != NULL) {
        *slot += weight;
    }
    return fmi3OK;
}

/* Writes the derivatives by the knowns, if all of them are finite. */
static fmi3Status write_sensitivity(Component *component, Seed *sensitivity, const fmi3ValueReference knowns[],
                                    double values[], size_t count) {
    Elements elements = elements_of(knowns), again = elements;
    for (size_t i = 0; i < count; i++) {
        const Variable *variable = next_element(&elements);
        const double value = *value_in_seed(sensitivity, variable);
        if (!isfinite(value)) {
            return fail(component, "the derivative by %s is %g at time %.17g; it is not defined for the present states "
                        "and inputs", variable->name, value, component->instance.state.time);
        }
    }
    for (size_t i = 0; i < count; i++) {
        values[i] = *value_in_seed(sensitivity, next_element(&again));
    }
    return fmi3OK;
}

fmi3Status fmi3GetAdjointDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[], size_t nUnknowns,
                                    const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[],
                                    size_t nSeed, fmi3Float64 sensitivity[], size_t nSensitivity) {
    Component *component = enter_present(instance, CALL_GetAdjointDerivative);
    if (component == NULL || check_lists(component, unknowns, nUnknowns, knowns, nKnowns, seed, nSeed, sensitivity,
                                         nSensitivity) != fmi3OK) {
        return fmi3Error;
    }
    Elements unknown = elements_of(unknowns), known = elements_of(knowns);
    Seed *gradient = &component->seed;
    Tangent *weights = &component->tangent;
    memset(gradient, 0, sizeof *gradient);
    memset(weights, 0, sizeof *weights);
    for (size_t i = 0; i < nSeed; i++) {
        if (add_weight(component, weights, gradient, next_element(&unknown), seed[i]) != fmi3OK) {
            return fmi3Error;
        }
    }
    for (size_t i = 0; i < nSensitivity; i++) {
        if (check_known(component, next_element(&known)) != fmi3OK) {
            return fmi3Error;
        }
    }
    if (!equations_adjoint(&component->instance, weights, gradient)) {
        return report_failure(component, fmi3Error);
    }
    return write_sensitivity(component, gradient, knowns, sensitivity, nSensitivity);
}
