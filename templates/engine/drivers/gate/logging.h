/* Messages to the importer. Nothing is ever written to stdout or stderr.

   Log categories; modelDescription.xml declares exactly these:
       logStatusWarning            a call that returned a warning
       logStatusDiscard            a call that was discarded
       logStatusError              a call that returned an error
       logSingularLinearSystems    a mass matrix that determines no accelerations (instead of one of the two above)
       logAll                      notes on tolerated calls; switching it on switches on all categories
   What is logged with logging off, too, the version says: told_always. */
#ifndef LOGGING_H
#define LOGGING_H

#include "component.h"

typedef enum {
    CATEGORY_WARNING,
    CATEGORY_DISCARD,
    CATEGORY_ERROR,
    CATEGORY_SINGULAR,
    CATEGORY_ALL,
    N_CATEGORIES
} Category;

#define ALL_CATEGORIES ((1u << N_CATEGORIES) - 1u)

#if defined __GNUC__
#define PRINTF_LIKE(text, first) __attribute__((format(printf, text, first)))
#else
#define PRINTF_LIKE(text, first)
#endif

/* "logStatusError" */
const char *category_name(Category category);

/* Logs a sentence, prefixed by the running function, enters the error state, returns STATUS_ERROR. */
Status fail(Component *component, const char *format, ...) PRINTF_LIKE(2, 3);

/* Logs a sentence and returns STATUS_DISCARD; the instance stays as it was. */
Status discard(Component *component, const char *format, ...) PRINTF_LIKE(2, 3);

/* Logs a sentence and returns STATUS_WARNING. */
Status warn(Component *component, const char *format, ...) PRINTF_LIKE(2, 3);

/* Logs a sentence in category logAll. */
void note(Component *component, const char *format, ...) PRINTF_LIKE(2, 3);

/* Logs the sentence on the failure of the instance, as fail() or discard() do, according to status. */
Status report_failure(Component *component, Status status);

/* Says what was noticed for the first time in the step of the importer that is complete. The step's status stays
   STATUS_OK: some importers end a run at a warning. */
void report_notices(Component *component);

/* Logs that no instance is made; there is none yet, so neither loggingOn nor categories are asked. */
void report_no_instance(const Importer *importer, const char *name, const char *format, ...) PRINTF_LIKE(3, 4);

#endif
