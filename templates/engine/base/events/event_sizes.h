/* The numbers of a mechanism with events; mechanism.h has those that they are made of. */
#ifndef EVENT_SIZES_H
#define EVENT_SIZES_H

#include "mechanism.h"

enum { N_EVENTS = N_SWITCHES + N_CONTACT_EVENTS };
enum {
    SIZE_EVENTS = N_EVENTS,
    SIZE_SWITCHES = N_SWITCHES > 0 ? N_SWITCHES : 1,
    SIZE_ELEMENTS = N_UNILATERALS + N_FRICTIONS > 0 ? N_UNILATERALS + N_FRICTIONS : 1,
    SIZE_UNILATERALS = N_UNILATERALS > 0 ? N_UNILATERALS : 1,
    SIZE_FRICTIONS = N_FRICTIONS > 0 ? N_FRICTIONS : 1
}; /* arrays have an entry at least */

#endif
