/* Messages to the importer. Nothing is ever written to stdout or stderr.

   Log categories; modelDescription.xml declares exactly these:
       logStatusWarning            a call that returned fmi2Warning
       logStatusDiscard            a call that returned fmi2Discard
       logStatusError              a call that returned fmi2Error
       logSingularLinearSystems    a mass matrix that determines no accelerations (instead of one of the two above)
       logAll                      notes on tolerated calls; switching it on switches on all categories
   Also with logging off errors are logged, and what is said of a step: why it failed, or a warning on results. */
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

/* Logs a sentence, prefixed by the running fmi2 function, enters the error state, returns fmi2Error. */
fmi2Status fail(Component *component, const char *format, ...) PRINTF_LIKE(2, 3);

/* Logs a sentence and returns fmi2Discard; the instance stays as it was. */
fmi2Status discard(Component *component, const char *format, ...) PRINTF_LIKE(2, 3);

/* Logs a sentence and returns fmi2Warning. */
fmi2Status warn(Component *component, const char *format, ...) PRINTF_LIKE(2, 3);

/* Logs a sentence in category logAll. */
void note(Component *component, const char *format, ...) PRINTF_LIKE(2, 3);

/* Logs the sentence on the failure of the instance, as fail() or discard() do, according to status. */
fmi2Status report_failure(Component *component, fmi2Status status);

/* Says what was noticed for the first time in the step of the importer that is complete. The step's status stays fmi2OK:
   some importers end a run at fmi2Warning. */
void report_notices(Component *component);

/* Logs that fmi2Instantiate is refused; there is no instance yet, so neither loggingOn nor categories are asked. */
void report_no_instance(const fmi2CallbackFunctions *functions, fmi2String name, const char *format, ...)
    PRINTF_LIKE(3, 4);

#endif
