#include "life.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "equations.h"
#include "events.h"
#include "logging.h"
#include "massless.h"
#include "observer.h"
#include "scale.h"
#include "settings.h"

bool names_fit(const Importer *importer, const char *name, const char *token, const char *token_name) {
    if (name == NULL || name[0] == '\0') {
        report_no_instance(importer, name, "the instance name is %s; expected a non-empty name",
                           name == NULL ? "NULL" : "empty");
        return false;
    }
    if (token == NULL || strcmp(token, MODEL_GUID) != 0) {
        report_no_instance(importer, name, "the %s is \"%s\", but this binary of %s has \"%s\"; binary and "
                           "modelDescription.xml are not from the same export", token_name,
                           token == NULL ? "NULL" : token, MODEL_NAME, MODEL_GUID);
        return false;
    }
    return true;
}

Component *component_new(const Importer *importer, InterfaceType type, const char *name, bool logging) {
    const size_t name_size = strlen(name) + 1, own = arena_bytes(sizeof(Component) + name_size, 1);
    const size_t work = ARENA_HEAD + ARENA_CAPACITY;
    if (OBSERVES && type == MODEL_EXCHANGE) {
        report_no_instance(importer, name, "%s observes, which is done in communication steps; instantiate it for "
                           "co-simulation", MODEL_NAME);
        return NULL;
    }
    Component *component = (Component *)calloc(1, own + work);
    if (component == NULL) {
        report_no_instance(importer, name, "there is no memory for an instance of %.0f bytes, of which %.0f are for "
                           "work", (double)(own + work), (double)work);
        return NULL;
    }
    instance_work_in(&component->instance, arena_begin((char *)component + own, ARENA_CAPACITY, ARENA_WORK));
    memcpy(component->name, name, name_size);
    component->type = type;
    component->importer = *importer;
    component->logging_requested = logging;
    component_start(component);
    return component;
}

void component_free(void *handle) {
    Component *component = (Component *)handle;
    if (component != NULL) {
        arena_end(component->instance.arena);
        free(component);
    }
}

Status set_up_experiment(Component *component, bool tolerance_defined, double tolerance, double start_time,
                         bool stop_time_defined, double stop_time) {
    State *state = &component->instance.state;
    if (tolerance_defined && !(tolerance >= LEAST_TOLERANCE && tolerance < 1.0)) {
        return fail(component, "the tolerance is %g; expected a relative tolerance of at least %g, which rounding "
                    "allows, and below 1", tolerance, LEAST_TOLERANCE);
    }
    if (!isfinite(start_time)) {
        return fail(component, "the start time is %.17g; expected a finite number", start_time);
    }
    if (stop_time_defined && !(stop_time >= start_time)) { /* infinite is tolerated: no end */
        return fail(component, "the stop time is %.17g; expected a time after the start time %.17g", stop_time,
                    start_time);
    }
    instance_assign(&component->instance, &state->time, start_time);
    state->start_time = start_time;
    instance_forget_cache(&component->instance);
    state->stop_time_defined = stop_time_defined;
    state->stop_time = stop_time_defined ? stop_time : 0.0;
    state->tolerance = tolerance_defined ? tolerance : 0.0;
    return STATUS_OK;
}

Status leave_initialization(Component *component, Mode next) {
    bool jumped;
    if (!equations_settle(&component->instance) || !events_refresh(&component->instance, &jumped) ||
        !observer_begin(&component->instance)) {
        return report_failure(component, STATUS_ERROR);
    }
    massless_keep(&component->instance.state);
    report_notices(component);
    set_mode(component, next);
    return STATUS_OK;
}

/* Adds the category of this name to the set. Returns false if there is none. */
static bool add_category(unsigned *categories, const char *name) {
    for (int i = 0; i < N_CATEGORIES; i++) {
        if (strcmp(name, category_name((Category)i)) == 0) {
            *categories |= i == CATEGORY_ALL ? ALL_CATEGORIES : 1u << i;
            return true;
        }
    }
    return false;
}

Status choose_categories(Component *component, size_t count, const char *const names[], unsigned *chosen,
                         const char **unknown) {
    *chosen = count == 0 ? ALL_CATEGORIES : 0u;
    *unknown = NULL;
    if (count > 0 && names == NULL) {
        return fail(component, "the array of %u categories is NULL", (unsigned)count);
    }
    for (size_t i = 0; i < count; i++) {
        if (names[i] == NULL) {
            return fail(component, "the name of category %u is NULL", (unsigned)i);
        }
        *unknown = add_category(chosen, names[i]) ? *unknown : names[i];
    }
    return STATUS_OK;
}

Status warn_of_category(Component *component, const char *name) {
    return warn(component, "there is no log category \"%s\"; modelDescription.xml lists the categories", name);
}

Status reset(void *handle) {
    Component *component = enter(handle, CALL_Reset);
    if (component == NULL) {
        return STATUS_ERROR;
    }
    component_start(component);
    return STATUS_OK;
}

Status terminate(void *handle) {
    Component *component = enter(handle, CALL_Terminate);
    if (component == NULL) {
        return STATUS_ERROR;
    }
    set_mode(component, MODE_TERMINATED);
    return STATUS_OK;
}
