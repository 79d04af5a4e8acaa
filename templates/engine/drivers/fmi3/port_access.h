/* From value references to variables. */
#ifndef PORT_ACCESS_H
#define PORT_ACCESS_H

#include "gate.h"

/* A type of variables, and which kinds are of it. */
typedef struct {
    const char *name;
    bool (*has)(VariableKind kind);
} PortType;

extern const PortType FLOAT64, INT32, INT64, CLOCK;

/* The elements of ports, one after the other; port is the index, among the references, of that of the last one. */
typedef struct {
    const fmi3ValueReference *references;
    size_t port;
    int element;
} Elements;

/* The elements of the ports with these references, none of them taken yet. */
static inline Elements elements_of(const fmi3ValueReference references[]) {
    return (Elements){references, 0, -1};
}

/* The next one; there must be one. */
const Variable *next_element(Elements *elements);

/* fmi3OK if these are references of ports of this type with n_values elements in all, and both arrays are there where
   they have elements. */
fmi3Status check_ports(Component *component, const fmi3ValueReference references[], size_t count, const PortType *type,
                       const void *values, size_t n_values);

/* fmi3OK if each of these ports is the first one of its slots: others are derivatives, of which this is said. */
fmi3Status check_first(Component *component, const fmi3ValueReference references[], size_t count, const char *said);

/* In intermediate update mode: fmi3OK if these are among the variables that the importer announced, and it may read or
   set them now. In other modes fmi3OK. */
fmi3Status check_intermediate(Component *component, const fmi3ValueReference references[], size_t count, bool sets);

#endif
