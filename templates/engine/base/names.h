/* The names of variables, for messages. */
#ifndef NAMES_H
#define NAMES_H

#include "variables.h"

/* The name of the variable of this kind and index, "?" if it has none. */
const char *variable_name(VariableKind kind, int index);

/* The name of the entry with this index, 0 to 2n - 1, of [q, qd]. */
const char *state_name(int index);

#endif
