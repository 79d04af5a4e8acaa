#include "port_access.h"

#include "logging.h"
#include "values.h"

static bool is_count(VariableKind kind) {
    return kind == VARIABLE_IMPACTS;
}

static bool is_mode(VariableKind kind) {
    return kind == VARIABLE_MODE;
}

static bool is_clock(VariableKind kind) {
    return kind == VARIABLE_CLOCK;
}

const PortType FLOAT64 = {"Float64", value_is_real};
const PortType INT32 = {"Int32", is_count};
const PortType INT64 = {"Int64", is_mode};
const PortType CLOCK = {"Clock", is_clock};

const Variable *next_element(Elements *elements) {
    elements->element++;
    while (elements->element >= PORTS[elements->references[elements->port]].count) {
        elements->port++;
        elements->element = 0;
    }
    return &VARIABLES[PORTS[elements->references[elements->port]].first + elements->element];
}

/* The name of the type that a port is of. */
static const char *type_of(const Port *port) {
    static const PortType *const TYPES[] = {&INT32, &INT64, &CLOCK};
    for (size_t i = 0; i < sizeof TYPES / sizeof TYPES[0]; i++) {
        if (TYPES[i]->has(VARIABLES[port->first].kind)) {
            return TYPES[i]->name;
        }
    }
    return FLOAT64.name;
}

fmi3Status check_ports(Component *component, const fmi3ValueReference references[], size_t count, const PortType *type,
                       const void *values, size_t n_values) {
    size_t elements = 0;
    if ((count > 0 && references == NULL) || (n_values > 0 && values == NULL)) {
        return fail(component, "the array of %u %s is NULL", (unsigned)(references == NULL ? count : n_values),
                    references == NULL ? "value references" : "values");
    }
    for (size_t i = 0; i < count; i++) {
        if (references[i] >= N_PORTS) {
            return fail(component, "there is no variable with value reference %u; expected 0 to %d", references[i],
                        N_PORTS - 1);
        }
        const Port *port = &PORTS[references[i]];
        if (!type->has(VARIABLES[port->first].kind)) {
            return fail(component, "variable %s is of type %s; expected one of type %s", port->name, type_of(port),
                        type->name);
        }
        elements += (size_t)port->count;
    }
    if (elements != n_values) {
        return fail(component, "the array of values has %u elements; the %u variables have %u in all",
                    (unsigned)n_values, (unsigned)count, (unsigned)elements);
    }
    return fmi3OK;
}

fmi3Status check_first(Component *component, const fmi3ValueReference references[], size_t count, const char *said) {
    for (size_t i = 0; i < count; i++) {
        if (PORTS[references[i]].second) {
            return fail(component, "variable %s is calculated from the others and %s", PORTS[references[i]].name,
                        said);
        }
    }
    return fmi3OK;
}

fmi3Status check_intermediate(Component *component, const fmi3ValueReference references[], size_t count, bool sets) {
    const Importer *importer = &component->importer;
    if (component->session.mode != MODE_INTERMEDIATE_UPDATE) {
        return fmi3OK;
    }
    if (sets ? !importer->may_set : !importer->may_get) {
        return fail(component, "variables cannot be %s in this intermediate update; expected a call with %s",
                    sets ? "set" : "read",
                    sets ? "intermediateVariableSetRequested" : "intermediateVariableGetAllowed");
    }
    for (size_t i = 0; i < count; i++) {
        if (!importer->intermediate[references[i]]) {
            return fail(component, "variable %s was not among the required intermediate variables of "
                        "fmi3InstantiateCoSimulation", PORTS[references[i]].name);
        }
    }
    return fmi3OK;
}
