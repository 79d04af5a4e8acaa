/* Functions for types that no variable has, and for clocks that are not triggered (FMI 3.0, sections 2.2.6.2 and
   2.2.9.4). An empty list is all that they take. */
#include "gate.h"
#include "logging.h"

/* The common body of all: what names the variables that there are none of. */
static fmi3Status refuse(fmi3Instance instance, Call call, const char *what, size_t count) {
    Component *component = enter(instance, call);
    if (component == NULL) {
        return fmi3Error;
    }
    return count == 0 ? fmi3OK
                      : fail(component, "this FMU has no %s; expected no value references, but got %u", what,
                             (unsigned)count);
}

#define REFUSED_TYPE(Type)                                                                                       \
    fmi3Status fmi3Get##Type(fmi3Instance instance, const fmi3ValueReference references[], size_t count,         \
                             fmi3##Type values[], size_t n_values) {                                             \
        (void)references;                                                                                        \
        (void)values;                                                                                            \
        (void)n_values;                                                                                          \
        return refuse(instance, CALL_Get##Type, "variables of type " #Type, count);                              \
    }                                                                                                            \
    fmi3Status fmi3Set##Type(fmi3Instance instance, const fmi3ValueReference references[], size_t count,         \
                             const fmi3##Type values[], size_t n_values) {                                       \
        (void)references;                                                                                        \
        (void)values;                                                                                            \
        (void)n_values;                                                                                          \
        return refuse(instance, CALL_Set##Type, "variables of type " #Type, count);                              \
    }

REFUSED_TYPE(Float32)
REFUSED_TYPE(Int8)
REFUSED_TYPE(UInt8)
REFUSED_TYPE(Int16)
REFUSED_TYPE(UInt16)
REFUSED_TYPE(UInt32)
REFUSED_TYPE(UInt64)
REFUSED_TYPE(Boolean)
REFUSED_TYPE(String)

fmi3Status fmi3GetBinary(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                         size_t valueSizes[], fmi3Binary values[], size_t nValues) {
    (void)valueReferences;
    (void)valueSizes;
    (void)values;
    (void)nValues;
    return refuse(instance, CALL_GetBinary, "variables of type Binary", nValueReferences);
}

fmi3Status fmi3SetBinary(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                         const size_t valueSizes[], const fmi3Binary values[], size_t nValues) {
    (void)valueReferences;
    (void)valueSizes;
    (void)values;
    (void)nValues;
    return refuse(instance, CALL_SetBinary, "variables of type Binary", nValueReferences);
}

fmi3Status fmi3GetIntervalDecimal(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                                  size_t nValueReferences, fmi3Float64 intervals[],
                                  fmi3IntervalQualifier qualifiers[]) {
    (void)valueReferences;
    (void)intervals;
    (void)qualifiers;
    return refuse(instance, CALL_GetIntervalDecimal, "clocks with an interval", nValueReferences);
}

fmi3Status fmi3GetIntervalFraction(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                                   size_t nValueReferences, fmi3UInt64 counters[], fmi3UInt64 resolutions[],
                                   fmi3IntervalQualifier qualifiers[]) {
    (void)valueReferences;
    (void)counters;
    (void)resolutions;
    (void)qualifiers;
    return refuse(instance, CALL_GetIntervalFraction, "clocks with an interval", nValueReferences);
}

fmi3Status fmi3SetIntervalDecimal(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                                  size_t nValueReferences, const fmi3Float64 intervals[]) {
    (void)valueReferences;
    (void)intervals;
    return refuse(instance, CALL_SetIntervalDecimal, "clocks with an interval", nValueReferences);
}

fmi3Status fmi3SetIntervalFraction(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                                   size_t nValueReferences, const fmi3UInt64 counters[],
                                   const fmi3UInt64 resolutions[]) {
    (void)valueReferences;
    (void)counters;
    (void)resolutions;
    return refuse(instance, CALL_SetIntervalFraction, "clocks with an interval", nValueReferences);
}

#define REFUSED_SHIFT(Get, Const)                                                                                \
    fmi3Status fmi3##Get##ShiftDecimal(fmi3Instance instance, const fmi3ValueReference references[],             \
                                       size_t count, Const fmi3Float64 shifts[]) {                               \
        (void)references;                                                                                        \
        (void)shifts;                                                                                            \
        return refuse(instance, CALL_##Get##ShiftDecimal, "clocks with a shift", count);                         \
    }                                                                                                            \
    fmi3Status fmi3##Get##ShiftFraction(fmi3Instance instance, const fmi3ValueReference references[],            \
                                        size_t count, Const fmi3UInt64 counters[],                               \
                                        Const fmi3UInt64 resolutions[]) {                                        \
        (void)references;                                                                                        \
        (void)counters;                                                                                          \
        (void)resolutions;                                                                                       \
        return refuse(instance, CALL_##Get##ShiftFraction, "clocks with a shift", count);                        \
    }

#define MUTABLE
REFUSED_SHIFT(Get, MUTABLE)
REFUSED_SHIFT(Set, const)
