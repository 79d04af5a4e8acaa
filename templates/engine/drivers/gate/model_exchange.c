#include "model_exchange.h"

#include <math.h>
#include <string.h>

#include "diagnosis.h"
#include "equations.h"
#include "importer_steps.h"
#include "logging.h"
#include "names.h"
#include "notices.h"

/* STATUS_OK if the array is not NULL and has an entry for each continuous state. */
static Status check_size(Component *component, const void *array, size_t nx) {
    if (nx != N_CONTINUOUS) {
        return fail(component, "the array has %u elements; expected one for each of the %d continuous states",
                    (unsigned)nx, N_CONTINUOUS);
    }
    return array != NULL ? STATUS_OK : fail(component, "the array of %d elements is NULL", N_CONTINUOUS);
}

Status enter_event_mode(void *handle) {
    Component *component = enter(handle, CALL_EnterEventMode);
    if (component == NULL) {
        return STATUS_ERROR;
    }
    set_mode(component, MODE_EVENT);
    importer_enters_event(&component->instance);
    return STATUS_OK;
}

Status update_states(Component *component, bool *changed, double *next_time) {
    Instance *instance = &component->instance;
    begin_notices(instance);
    if (!importer_updates_states(instance, changed)) {
        return report_failure(component, STATUS_ERROR);
    }
    report_notices(component);
    *next_time = importer_next_event(instance);
    return STATUS_OK;
}

Status enter_continuous_time_mode(void *handle) {
    Component *component = enter(handle, CALL_EnterContinuousTimeMode);
    if (component == NULL) {
        return STATUS_ERROR;
    }
    set_mode(component, MODE_CONTINUOUS_TIME);
    importer_leaves_event(&component->instance);
    return STATUS_OK;
}

Status complete_step(Component *component, bool *needs_event) {
    *needs_event = importer_completes_step(&component->instance);
    report_notices(component);
    return STATUS_OK;
}

/* A time after the stop time is accepted: integrators step over the end and interpolate. */
Status set_time(void *handle, double time) {
    Component *component = enter(handle, CALL_SetTime);
    if (component == NULL) {
        return STATUS_ERROR;
    }
    if (!isfinite(time)) {
        return fail(component, "the time is %g; expected a finite number", time);
    }
    instance_assign(&component->instance, &component->instance.state.time, time);
    return STATUS_OK;
}

/* States that are not finite are discarded, not an error: the importer's integrator then tries a smaller step. */
Status set_states(void *handle, const double x[], size_t nx) {
    Component *component = enter(handle, CALL_SetContinuousStates);
    if (component == NULL || check_size(component, x, nx) != STATUS_OK) {
        return STATUS_ERROR;
    }
    for (int i = 0; i < N_CONTINUOUS; i++) {
        if (!isfinite(x[i])) {
            return discard(component, "the state %s cannot be set to %g; expected a finite number, and nothing was set",
                           state_name(CONTINUOUS_STATES[i]), x[i]);
        }
    }
    for (int i = 0; i < N_CONTINUOUS; i++) {
        instance_assign(&component->instance, &component->instance.state.states[CONTINUOUS_STATES[i]], x[i]);
    }
    return STATUS_OK;
}

Status get_derivatives(void *handle, Call call, double derivatives[], size_t nx) {
    Component *component = enter(handle, call);
    if (component == NULL || check_size(component, derivatives, nx) != STATUS_OK) {
        return STATUS_ERROR;
    }
    if (!equations_settle(&component->instance)) {
        return report_failure(component, STATUS_ERROR);
    }
    if (!importer_derivatives(&component->instance, derivatives)) {
        return report_failure(component, STATUS_DISCARD);
    }
    if (!component->noted_singularity &&
        runs_into_singularity(&component->instance, component->instance.cache.accelerations)) {
        component->noted_singularity = true;
        report_failure(component, STATUS_WARNING); /* but STATUS_OK: some importers end a run at a warning */
    }
    return STATUS_OK;
}

Status get_indicators(void *handle, double indicators[], size_t ni) {
    Component *component = enter(handle, CALL_GetEventIndicators);
    if (component == NULL) {
        return STATUS_ERROR;
    }
    if (ni != N_EVENTS) {
        return fail(component, "the array has %u elements; expected one for each of the %d event indicators",
                    (unsigned)ni, N_EVENTS);
    }
    if (ni > 0 && indicators == NULL) {
        return fail(component, "the array of %d elements is NULL", N_EVENTS);
    }
    if (N_EVENTS == 0) {
        return STATUS_OK; /* whatever the states are: there is nothing to say about them */
    }
    if (!equations_settle(&component->instance)) {
        return report_failure(component, STATUS_ERROR);
    }
    if (!equations_indicators(&component->instance)) {
        return report_failure(component, STATUS_DISCARD);
    }
    memcpy(indicators, component->instance.cache.indicators, N_EVENTS * sizeof(double));
    return STATUS_OK;
}

Status get_states(void *handle, double x[], size_t nx) {
    Component *component = enter(handle, CALL_GetContinuousStates);
    if (component == NULL || check_size(component, x, nx) != STATUS_OK) {
        return STATUS_ERROR;
    }
    if (!equations_settle(&component->instance)) {
        return report_failure(component, STATUS_ERROR);
    }
    for (int i = 0; i < N_CONTINUOUS; i++) {
        x[i] = component->instance.state.states[CONTINUOUS_STATES[i]];
    }
    return STATUS_OK;
}

Status get_nominals(void *handle, double nominals[], size_t nx) {
    Component *component = enter(handle, CALL_GetNominalsOfContinuousStates);
    if (component == NULL || check_size(component, nominals, nx) != STATUS_OK) {
        return STATUS_ERROR;
    }
    for (int i = 0; i < N_CONTINUOUS; i++) {
        nominals[i] = NOMINAL_STATES[CONTINUOUS_STATES[i]];
    }
    return STATUS_OK;
}
