/* Model exchange, as far as the versions agree on it: bodies of functions of the standard. The modes of the mechanism
   change in event mode alone. */
#ifndef MODEL_EXCHANGE_H
#define MODEL_EXCHANGE_H

#include "gate.h"

Status enter_event_mode(void *handle);
Status enter_continuous_time_mode(void *handle);

/* In event mode: *changed says whether continuous states were changed, *next_time (s) is HUGE_VAL if no event is known
   in advance. */
Status update_states(Component *component, bool *changed, double *next_time);

/* A step of the importer's solver is completed; *needs_event: states have drifted from the constraints. */
Status complete_step(Component *component, bool *needs_event);

Status set_time(void *handle, double time);
Status set_states(void *handle, const double x[], size_t nx);
Status get_states(void *handle, double x[], size_t nx);
Status get_derivatives(void *handle, Call call, double derivatives[], size_t nx);
Status get_indicators(void *handle, double indicators[], size_t ni);
Status get_nominals(void *handle, double nominals[], size_t nx);

#endif
