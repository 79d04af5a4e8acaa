/* Formatting messages and handing them to the importer's logger. */
#include "logging.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "failure_sentence.h"
#include "notice_sentence.h"

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

/* Hands over finished text, with those characters doubled that would mean something else than themselves. */
static void escape_and_deliver(const Importer *importer, const char *name, Status status, Category category,
                               const char *text) {
    char escaped[2 * SENTENCE_SIZE];
    size_t used = 0;
    for (const char *c = text; *c != '\0'; c++) {
        if (strchr(DOUBLED, *c) != NULL) {
            escaped[used++] = *c;
        }
        escaped[used++] = *c;
    }
    escaped[used] = '\0';
    deliver(importer, name, status, CATEGORY_NAMES[category], escaped);
}

/* Is a message of this status delivered? */
static bool is_wanted(const Component *component, Status status, Category category) {
    return told_always(status, component->call) || (component->categories & (1u << category)) != 0u;
}

/* Hands over a message of a component. What the logger calls meanwhile enter() refuses, and the next message says so
   (FMI 3.0, section 2.1: it must not call back into the FMU). */
static void tell(Component *component, Status status, Category category, const char *text) {
    char sentence[SENTENCE_SIZE];
    component->logging = true;
    escape_and_deliver(&component->importer, component->name, status, category, text);
    if (component->called_back != NULL) {
        snprintf(sentence, sizeof sentence, "%s: illegal in the importer's logger, which must not call functions of "
                 "the FMU; nothing was done", component->called_back);
        escape_and_deliver(&component->importer, component->name, STATUS_ERROR, CATEGORY_ERROR, sentence);
    }
    component->called_back = NULL;
    component->logging = false;
}

/* Formats and delivers a message of a component if it is wanted. */
static void report(Component *component, Status status, Category category, const char *format,
                   va_list arguments) {
    char text[SENTENCE_SIZE];
    if (!is_wanted(component, status, category)) {
        return;
    }
    const int prefix = snprintf(text, sizeof text, "%s: ", call_name(component->call));
    if (prefix > 0 && prefix < SENTENCE_SIZE) {
        vsnprintf(text + prefix, sizeof text - (size_t)prefix, format, arguments);
    }
    tell(component, status, category, text);
}

Status fail(Component *component, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    report(component, STATUS_ERROR, CATEGORY_ERROR, format, arguments);
    va_end(arguments);
    set_mode(component, MODE_ERROR);
    return STATUS_ERROR;
}

Status discard(Component *component, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    report(component, STATUS_DISCARD, CATEGORY_DISCARD, format, arguments);
    va_end(arguments);
    return STATUS_DISCARD;
}

Status warn(Component *component, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    report(component, STATUS_WARNING, CATEGORY_WARNING, format, arguments);
    va_end(arguments);
    return STATUS_WARNING;
}

void note(Component *component, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    report(component, STATUS_OK, CATEGORY_ALL, format, arguments);
    va_end(arguments);
}

/* As report(), with the arguments written out. */
static void report_text(Component *component, Status status, Category category, const char *format, ...)
    PRINTF_LIKE(4, 5);
static void report_text(Component *component, Status status, Category category, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    report(component, status, category, format, arguments);
    va_end(arguments);
}

Status report_failure(Component *component, Status status) {
    char sentence[SENTENCE_SIZE];
    const FailureKind kind = component->instance.failure.kind;
    const bool singular = kind == FAILURE_SINGULAR || kind == FAILURE_NEARLY_SINGULAR;
    const bool singular_logged = (component->categories & (1u << CATEGORY_SINGULAR)) != 0u;
    Category category = status == STATUS_ERROR     ? CATEGORY_ERROR
                        : status == STATUS_DISCARD ? CATEGORY_DISCARD
                                                : CATEGORY_WARNING;
    if (singular && singular_logged) {
        category = CATEGORY_SINGULAR;
    }
    failure_sentence(&component->instance.failure, sentence, sizeof sentence);
    report_text(component, status, category, "%s", sentence);
    if (status == STATUS_ERROR) {
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

void report_no_instance(const Importer *importer, const char *name, const char *format, ...) {
    char text[SENTENCE_SIZE];
    const int prefix = snprintf(text, sizeof text, "%s: ", INSTANTIATE);
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text + prefix, sizeof text - (size_t)prefix, format, arguments);
    va_end(arguments);
    escape_and_deliver(importer, name != NULL ? name : "", STATUS_ERROR, CATEGORY_ERROR, text);
}
