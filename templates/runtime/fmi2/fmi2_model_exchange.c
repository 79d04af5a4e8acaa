/* Model exchange (FMI 2.0, section 3.2). The modes of the mechanism change in event mode alone. */
#include <math.h>
#include <string.h>

#include "diagnosis.h"
#include "equations.h"
#include "importer_steps.h"
#include "gate.h"
#include "logging.h"
#include "names.h"

/* fmi2OK if the array is not NULL and has an entry for each continuous state. */
static fmi2Status check_size(Component *component, const void *array, size_t nx) {
    if (nx != N_CONTINUOUS) {
        return fail(component, "the array has %u elements; expected one for each of the %d continuous states",
                    (unsigned)nx, N_CONTINUOUS);
    }
    return array != NULL ? fmi2OK : fail(component, "the array of %d elements is NULL", N_CONTINUOUS);
}

fmi2Status fmi2EnterEventMode(fmi2Component c) {
    Component *component = enter(c, CALL_EnterEventMode);
    if (component == NULL) {
        return fmi2Error;
    }
    set_mode(component, MODE_EVENT);
    importer_enters_event(&component->instance);
    return fmi2OK;
}

fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *eventInfo) {
    Component *component = enter(c, CALL_NewDiscreteStates);
    bool changed;
    if (component == NULL) {
        return fmi2Error;
    }
    if (eventInfo == NULL) {
        return fail(component, "the argument eventInfo is NULL; expected the address of an fmi2EventInfo");
    }
    memset(eventInfo, 0, sizeof *eventInfo); /* all flags fmi2False, no next event */
    if (!importer_updates_states(&component->instance, &changed)) {
        return report_failure(component, fmi2Error);
    }
    const double next = importer_next_event(&component->instance);
    eventInfo->nextEventTimeDefined = isfinite(next) ? fmi2True : fmi2False;
    eventInfo->nextEventTime = isfinite(next) ? next : 0.0;
    eventInfo->valuesOfContinuousStatesChanged = changed ? fmi2True : fmi2False;
    return fmi2OK;
}

fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c) {
    Component *component = enter(c, CALL_EnterContinuousTimeMode);
    if (component == NULL) {
        return fmi2Error;
    }
    set_mode(component, MODE_CONTINUOUS_TIME);
    importer_leaves_event(&component->instance);
    return fmi2OK;
}

fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean noSetFMUStatePriorToCurrentPoint,
                                       fmi2Boolean *enterEventMode, fmi2Boolean *terminateSimulation) {
    Component *component = enter(c, CALL_CompletedIntegratorStep);
    (void)noSetFMUStatePriorToCurrentPoint; /* no earlier point is kept, so this allows nothing */
    if (component == NULL) {
        return fmi2Error;
    }
    if (enterEventMode == NULL || terminateSimulation == NULL) {
        return fail(component, "the argument %s is NULL; expected the address of an fmi2Boolean",
                    enterEventMode == NULL ? "enterEventMode" : "terminateSimulation");
    }
    *enterEventMode = importer_completes_step(&component->instance) ? fmi2True : fmi2False;
    *terminateSimulation = fmi2False;
    report_notices(component);
    return fmi2OK;
}

/* A time after the stop time is accepted: integrators step over the end and interpolate. */
fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time) {
    Component *component = enter(c, CALL_SetTime);
    if (component == NULL) {
        return fmi2Error;
    }
    if (!isfinite(time)) {
        return fail(component, "the time is %g; expected a finite number", time);
    }
    instance_assign(&component->instance, &component->instance.state.time, time);
    return fmi2OK;
}

/* States that are not finite are discarded, not an error: the importer's integrator then tries a smaller step. */
fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t nx) {
    Component *component = enter(c, CALL_SetContinuousStates);
    if (component == NULL || check_size(component, x, nx) != fmi2OK) {
        return fmi2Error;
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
    return fmi2OK;
}

/* The derivative of an entry of the states, with the accelerations up to date. */
static double derivative_of(const Instance *instance, int state) {
    if (state < N_COORDINATES) {
        return instance->state.states[N_COORDINATES + state];
    }
    return state < 2 * N_COORDINATES ? instance->cache.accelerations[state - N_COORDINATES]
                                     : instance->cache.further[state - 2 * N_COORDINATES];
}

fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real derivatives[], size_t nx) {
    Component *component = enter(c, CALL_GetDerivatives);
    if (component == NULL || check_size(component, derivatives, nx) != fmi2OK) {
        return fmi2Error;
    }
    if (!equations_settle(&component->instance)) {
        return report_failure(component, fmi2Error);
    }
    if (!equations_accelerations(&component->instance)) {
        return report_failure(component, fmi2Discard);
    }
    for (int i = 0; i < N_CONTINUOUS; i++) {
        derivatives[i] = derivative_of(&component->instance, CONTINUOUS_STATES[i]);
    }
    if (!component->noted_singularity &&
        runs_into_singularity(&component->instance, component->instance.cache.accelerations)) {
        component->noted_singularity = true;
        report_failure(component, fmi2Warning); /* and fmi2OK: some importers end a run at fmi2Warning */
    }
    return fmi2OK;
}

fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real eventIndicators[], size_t ni) {
    Component *component = enter(c, CALL_GetEventIndicators);
    if (component == NULL) {
        return fmi2Error;
    }
    if (ni != N_EVENTS) {
        return fail(component, "the array has %u elements; expected one for each of the %d event indicators",
                    (unsigned)ni, N_EVENTS);
    }
    if (ni > 0 && eventIndicators == NULL) {
        return fail(component, "the array of %d elements is NULL", N_EVENTS);
    }
    if (N_EVENTS == 0) {
        return fmi2OK; /* whatever the states are: there is nothing to say about them */
    }
    if (!equations_settle(&component->instance)) {
        return report_failure(component, fmi2Error);
    }
    if (!equations_indicators(&component->instance)) {
        return report_failure(component, fmi2Discard);
    }
    memcpy(eventIndicators, component->instance.cache.indicators, N_EVENTS * sizeof(double));
    return fmi2OK;
}

fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t nx) {
    Component *component = enter(c, CALL_GetContinuousStates);
    if (component == NULL || check_size(component, x, nx) != fmi2OK) {
        return fmi2Error;
    }
    if (!equations_settle(&component->instance)) {
        return report_failure(component, fmi2Error);
    }
    for (int i = 0; i < N_CONTINUOUS; i++) {
        x[i] = component->instance.state.states[CONTINUOUS_STATES[i]];
    }
    return fmi2OK;
}

fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real x_nominal[], size_t nx) {
    Component *component = enter(c, CALL_GetNominalsOfContinuousStates);
    if (component == NULL || check_size(component, x_nominal, nx) != fmi2OK) {
        return fmi2Error;
    }
    for (int i = 0; i < N_CONTINUOUS; i++) {
        x_nominal[i] = NOMINAL_STATES[CONTINUOUS_STATES[i]];
    }
    return fmi2OK;
}
