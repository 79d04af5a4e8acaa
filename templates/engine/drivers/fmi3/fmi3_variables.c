/* Reading and setting variables (FMI 3.0, section 2.2.6.2). */
#include "equations.h"
#include "gated_values.h"
#include "logging.h"
#include "port_access.h"
#include "values.h"

/* The component, for reading variables of a type; NULL if the call is not in order. */
static Component *enter_reading(fmi3Instance instance, Call call, const fmi3ValueReference references[], size_t count,
                                const PortType *type, const void *values, size_t n_values) {
    Component *component = enter_present(instance, call);
    if (component == NULL || check_ports(component, references, count, type, values, n_values) != fmi3OK ||
        check_intermediate(component, references, count, false) != fmi3OK) {
        return NULL;
    }
    if (!equations_settle(&component->instance)) {
        report_failure(component, fmi3Error);
        return NULL;
    }
    return component;
}

fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          fmi3Float64 values[], size_t nValues) {
    Component *component =
        enter_reading(instance, CALL_GetFloat64, valueReferences, nValueReferences, &FLOAT64, values, nValues);
    if (component == NULL) {
        return fmi3Error;
    }
    Elements elements = elements_of(valueReferences), again = elements;
    for (size_t i = 0; i < nValues; i++) {
        const fmi3Status status = evaluate(component, next_element(&elements));
        if (status != fmi3OK) {
            return status;
        }
    }
    for (size_t i = 0; i < nValues; i++) {
        values[i] = *value_slot(&component->instance, next_element(&again));
    }
    return fmi3OK;
}

fmi3Status fmi3GetInt32(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                        fmi3Int32 values[], size_t nValues) {
    Component *component =
        enter_reading(instance, CALL_GetInt32, valueReferences, nValueReferences, &INT32, values, nValues);
    if (component == NULL) {
        return fmi3Error;
    }
    Elements elements = elements_of(valueReferences);
    for (size_t i = 0; i < nValues; i++) {
        values[i] = value_integer(&component->instance, next_element(&elements));
    }
    return fmi3OK;
}

fmi3Status fmi3GetInt64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                        fmi3Int64 values[], size_t nValues) {
    Component *component =
        enter_reading(instance, CALL_GetInt64, valueReferences, nValueReferences, &INT64, values, nValues);
    if (component == NULL) {
        return fmi3Error;
    }
    Elements elements = elements_of(valueReferences);
    for (size_t i = 0; i < nValues; i++) {
        values[i] = value_integer(&component->instance, next_element(&elements));
    }
    return fmi3OK;
}

fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          const fmi3Float64 values[], size_t nValues) {
    Component *component = enter_present(instance, CALL_SetFloat64);
    if (component == NULL ||
        check_ports(component, valueReferences, nValueReferences, &FLOAT64, values, nValues) != fmi3OK ||
        check_intermediate(component, valueReferences, nValueReferences, true) != fmi3OK ||
        check_first(component, valueReferences, nValueReferences, "cannot be set") != fmi3OK) {
        return fmi3Error;
    }
    Elements elements = elements_of(valueReferences), again = elements;
    for (size_t i = 0; i < nValues; i++) {
        const fmi3Status status = check_value(component, next_element(&elements), values[i]);
        if (status != fmi3OK) {
            return status;
        }
    }
    for (size_t i = 0; i < nValues; i++) {
        instance_assign(&component->instance, value_slot(&component->instance, next_element(&again)), values[i]);
    }
    return fmi3OK;
}

/* Counts and modes are calculated. */
static fmi3Status refuse_to_set(fmi3Instance instance, Call call, const fmi3ValueReference references[], size_t count,
                                const PortType *type, const void *values, size_t n_values) {
    Component *component = enter(instance, call);
    if (component == NULL || check_ports(component, references, count, type, values, n_values) != fmi3OK) {
        return fmi3Error;
    }
    return count == 0 ? fmi3OK
                      : fail(component, "variable %s is calculated from the others and cannot be set",
                             PORTS[references[0]].name);
}

fmi3Status fmi3SetInt32(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                        const fmi3Int32 values[], size_t nValues) {
    return refuse_to_set(instance, CALL_SetInt32, valueReferences, nValueReferences, &INT32, values, nValues);
}

fmi3Status fmi3SetInt64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                        const fmi3Int64 values[], size_t nValues) {
    return refuse_to_set(instance, CALL_SetInt64, valueReferences, nValueReferences, &INT64, values, nValues);
}
