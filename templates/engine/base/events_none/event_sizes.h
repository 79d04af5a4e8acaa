/* The numbers of a mechanism without events. */
#ifndef EVENT_SIZES_H
#define EVENT_SIZES_H

enum { N_MASKS = 0, N_SWITCHES = 0, N_UNILATERALS = 0, N_FRICTIONS = 0, N_EVENTS = 0, TIME_STEPPING = 0 };
/* Arrays have an entry at least. */
enum { SIZE_EVENTS = 1, SIZE_SWITCHES = 1, SIZE_ELEMENTS = 1, SIZE_UNILATERALS = 1 };

#endif
