/* Reading and setting one variable, with the checks that the standard asks for. */
#ifndef GATED_VALUES_H
#define GATED_VALUES_H

#include "gate.h"

/* STATUS_OK if neither array is NULL where it has elements. */
Status check_arrays(Component *component, const void *references, size_t count, const void *values);

/* STATUS_OK if the variable, a real number, has a finite value now. Otherwise STATUS_DISCARD in model exchange, so that
   the importer may try a smaller step; in co-simulation the standard leaves an error only. */
Status evaluate(Component *component, const Variable *variable);

/* STATUS_OK if a real variable may take this value now, STATUS_DISCARD if the value is out of range, else
   STATUS_ERROR. */
Status check_value(Component *component, const Variable *variable, double value);

#endif
