/* The life of an instance, as far as the versions agree on it. */
#ifndef LIFE_H
#define LIFE_H

#include "arena_size.h"
#include "gate.h"

/* Bytes of an instance, to which its name is added. */
#define COMPONENT_SIZE (sizeof(Component) + ARENA_HEAD + ARENA_CAPACITY)

/* Are name and token (the GUID of FMI 2.0) those of an instance of this FMU? If not, the reason is logged. */
bool names_fit(const Importer *importer, const char *name, const char *token, const char *token_name);

/* A new component, started; NULL, with the reason logged, if there is no memory. */
Component *component_new(const Importer *importer, InterfaceType type, const char *name, bool logging);

/* The end of a component; NULL is none. */
void component_free(void *handle);

/* Takes over tolerance, start time (s) and stop time (s) of the experiment, with all checks. */
Status set_up_experiment(Component *component, bool tolerance_defined, double tolerance, double start_time,
                         bool stop_time_defined, double stop_time);

/* Ends initialization mode: solves for the start, decides the modes, goes on to the next mode. */
Status leave_initialization(Component *component, Mode next);

/* The set of these log categories, into *chosen; all if count is 0. *unknown: the last name that is none, or NULL. */
Status choose_categories(Component *component, size_t count, const char *const names[], unsigned *chosen,
                         const char **unknown);

/* Says that a name is none of a log category. */
Status warn_of_category(Component *component, const char *name);

Status reset(void *handle);
Status terminate(void *handle);

#endif
