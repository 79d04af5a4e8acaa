/* What the value references of FMI 3.0 stand for, and what depends on what. The tables are in the generated ports.c,
   their sizes N_PORTS and N_DEPENDENCIES in the generated ports_size.h. */
#ifndef PORTS_H
#define PORTS_H

#include "ports_size.h"
#include "variables.h"

/* A scalar or an array: VARIABLES[first] to VARIABLES[first + count - 1], row by row, all of one type. Its value
   reference is its index in PORTS. Aliases share it. The second port of the same slots is the derivative of a state
   by its own name: it is calculated and cannot be set. */
typedef struct {
    const char *name;
    int first;
    int count;
    int second; /* 1: it is the second one */
} Port;

/* A port that an unknown depends on, as modelDescription.xml says it. */
typedef struct {
    int known;    /* its index in PORTS */
    int constant; /* 1: dependenciesKind "constant", 0: "dependent" */
} Dependency;

extern const Port PORTS[N_PORTS];
extern const int FIRST_DEPENDENCIES[N_PORTS + 1]; /* of each port among the dependencies, and their end */
extern const Dependency DEPENDENCIES[N_DEPENDENCIES > 0 ? N_DEPENDENCIES : 1];

#endif
