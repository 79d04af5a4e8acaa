/* What variables depend on (FMI 3.0, section 2.2.10), as modelDescription.xml says it. */
#include "gate.h"
#include "logging.h"

/* The number of dependencies of a port; fmi3Error, after the error was reported, if there is no such port. */
static fmi3Status count_dependencies(Component *component, fmi3ValueReference reference, size_t *count) {
    if (reference >= N_PORTS) {
        return fail(component, "there is no variable with value reference %u; expected 0 to %d", reference,
                    N_PORTS - 1);
    }
    *count = (size_t)(FIRST_DEPENDENCIES[reference + 1] - FIRST_DEPENDENCIES[reference]);
    return fmi3OK;
}

fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance instance, fmi3ValueReference valueReference,
                                               size_t *nDependencies) {
    Component *component =
        enter_with(instance, CALL_GetNumberOfVariableDependencies, nDependencies, "nDependencies");
    return component == NULL ? fmi3Error : count_dependencies(component, valueReference, nDependencies);
}

fmi3Status fmi3GetVariableDependencies(fmi3Instance instance, fmi3ValueReference dependent,
                                       size_t elementIndicesOfDependent[], fmi3ValueReference independents[],
                                       size_t elementIndicesOfIndependents[], fmi3DependencyKind dependencyKinds[],
                                       size_t nDependencies) {
    Component *component = enter(instance, CALL_GetVariableDependencies);
    size_t count = 0;
    if (component == NULL || count_dependencies(component, dependent, &count) != fmi3OK) {
        return fmi3Error;
    }
    if (nDependencies != count) {
        return fail(component, "there is room for %u dependencies of variable %s; it has %u", (unsigned)nDependencies,
                    PORTS[dependent].name, (unsigned)count);
    }
    if (count > 0 && (elementIndicesOfDependent == NULL || independents == NULL ||
                      elementIndicesOfIndependents == NULL || dependencyKinds == NULL)) {
        return fail(component, "an array is NULL; expected four for %u dependencies", (unsigned)count);
    }
    const Dependency *dependencies = DEPENDENCIES + FIRST_DEPENDENCIES[dependent];
    for (size_t i = 0; i < count; i++) {
        elementIndicesOfDependent[i] = elementIndicesOfIndependents[i] = 0; /* all elements */
        independents[i] = (fmi3ValueReference)dependencies[i].known;
        dependencyKinds[i] = dependencies[i].constant ? fmi3Constant : fmi3Dependent;
    }
    return fmi3OK;
}
