/* Formatting messages and handing them to the importer's logger. */
#include "logging.h"

#include <stdarg.h>
#include <stdio.h>

#include "failure.h"
#include "notices.h"

static const char *const CATEGORY_NAMES[N_CATEGORIES] = {
    [CATEGORY_WARNING]  = "logStatusWarning",
    [CATEGORY_DISCARD]  = "logStatusDiscard",
    [CATEGORY_ERROR]    = "logStatusError",
    [CATEGORY_SINGULAR] = "logSingularLinearSystems",
    [CATEGORY_ALL]      = "logAll",
};

const char *category_name(Category category) {
    return CATEGORY_NAMES[category];
}

/* Calls a logger with finished text: as an argument of "%s", so that a % stays a %, and with # doubled, because #r1#
   would mean the variable with value reference 1 (section 2.1.5 of the standard). */
static void deliver(const fmi2CallbackFunctions *callbacks, fmi2String name, fmi2Status status, Category category,
                    const char *text) {
    char escaped[2 * SENTENCE_SIZE];
    size_t used = 0;
    for (const char *c = text; *c != '\0'; c++) {
        if (*c == '#') {
            escaped[used++] = '#';
        }
        escaped[used++] = *c;
    }
    escaped[used] = '\0';
    callbacks->logger(callbacks->componentEnvironment, name, status, CATEGORY_NAMES[category], "%s", escaped);
}

/* Is a message of this status delivered? Errors are, and what is said of a step's results, also with logging off. */
static bool is_wanted(const Component *component, fmi2Status status, Category category) {
    const bool ends_step = component->call == CALL_DoStep || component->call == CALL_CompletedIntegratorStep;
    const bool needed = status == fmi2Error || (status != fmi2OK && ends_step);
    return component->callbacks.logger != NULL && (needed || (component->categories & (1u << category)) != 0u);
}

/* Formats and delivers a message of a component if it is wanted. */
static void report(const Component *component, fmi2Status status, Category category, const char *format,
                   va_list arguments) {
    char text[SENTENCE_SIZE];
    if (!is_wanted(component, status, category)) {
        return;
    }
    const int prefix = snprintf(text, sizeof text, "%s: ", call_name(component->call));
    if (prefix > 0 && prefix < SENTENCE_SIZE) {
        vsnprintf(text + prefix, sizeof text - (size_t)prefix, format, arguments);
    }
    deliver(&component->callbacks, component->name, status, category, text);
}

fmi2Status fail(Component *component, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    report(component, fmi2Error, CATEGORY_ERROR, format, arguments);
    va_end(arguments);
    set_mode(component, MODE_ERROR);
    return fmi2Error;
}

fmi2Status discard(Component *component, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    report(component, fmi2Discard, CATEGORY_DISCARD, format, arguments);
    va_end(arguments);
    return fmi2Discard;
}

fmi2Status warn(Component *component, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    report(component, fmi2Warning, CATEGORY_WARNING, format, arguments);
    va_end(arguments);
    return fmi2Warning;
}

void note(Component *component, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    report(component, fmi2OK, CATEGORY_ALL, format, arguments);
    va_end(arguments);
}

/* As report(), with the arguments written out. */
static void report_text(const Component *component, fmi2Status status, Category category, const char *format, ...)
    PRINTF_LIKE(4, 5);
static void report_text(const Component *component, fmi2Status status, Category category, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    report(component, status, category, format, arguments);
    va_end(arguments);
}

fmi2Status report_failure(Component *component, fmi2Status status) {
    char sentence[SENTENCE_SIZE];
    const FailureKind kind = component->instance.failure.kind;
    const bool singular = kind == FAILURE_SINGULAR || kind == FAILURE_NEARLY_SINGULAR;
    const bool singular_logged = (component->categories & (1u << CATEGORY_SINGULAR)) != 0u;
    Category category = status == fmi2Error     ? CATEGORY_ERROR
                        : status == fmi2Discard ? CATEGORY_DISCARD
                                                : CATEGORY_WARNING;
    if (singular && singular_logged) {
        category = CATEGORY_SINGULAR;
    }
    failure_sentence(&component->instance.failure, sentence, sizeof sentence);
    report_text(component, status, category, "%s", sentence);
    if (status == fmi2Error) {
        set_mode(component, MODE_ERROR);
    }
    return status;
}

void report_notices(Component *component) {
    char sentence[SENTENCE_SIZE];
    for (int i = 0; i < component->instance.n_notices; i++) {
        notice_sentence(&component->instance.notices[i], sentence, sizeof sentence);
        warn(component, "%s", sentence);
    }
}

void report_no_instance(const fmi2CallbackFunctions *functions, fmi2String name, const char *format, ...) {
    char text[SENTENCE_SIZE];
    if (functions == NULL || functions->logger == NULL) {
        return;
    }
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    deliver(functions, name != NULL ? name : "", fmi2Error, CATEGORY_ERROR, text);
}
