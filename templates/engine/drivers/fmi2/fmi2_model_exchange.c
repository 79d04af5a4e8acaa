/* Model exchange (FMI 2.0, section 3.2). */
#include <math.h>
#include <string.h>

#include "logging.h"
#include "model_exchange.h"

fmi2Status fmi2EnterEventMode(fmi2Component c) {
    return enter_event_mode(c);
}

fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *eventInfo) {
    Component *component = enter_with(c, CALL_NewDiscreteStates, eventInfo, "eventInfo");
    bool changed;
    double next;
    if (component == NULL || update_states(component, &changed, &next) != fmi2OK) {
        return fmi2Error;
    }
    memset(eventInfo, 0, sizeof *eventInfo); /* all flags fmi2False, no next event */
    eventInfo->nextEventTimeDefined = isfinite(next) ? fmi2True : fmi2False;
    eventInfo->nextEventTime = isfinite(next) ? next : 0.0;
    eventInfo->valuesOfContinuousStatesChanged = changed ? fmi2True : fmi2False;
    return fmi2OK;
}

fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c) {
    return enter_continuous_time_mode(c);
}

fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean noSetFMUStatePriorToCurrentPoint,
                                       fmi2Boolean *enterEventMode, fmi2Boolean *terminateSimulation) {
    (void)noSetFMUStatePriorToCurrentPoint; /* no earlier point is kept, so this allows nothing */
    Component *component = enter(c, CALL_CompletedIntegratorStep);
    bool needs_event;
    if (component == NULL) {
        return fmi2Error;
    }
    if (enterEventMode == NULL || terminateSimulation == NULL) {
        return fail(component, "the argument %s is NULL; expected the address of an fmi2Boolean",
                    enterEventMode == NULL ? "enterEventMode" : "terminateSimulation");
    }
    complete_step(component, &needs_event);
    *enterEventMode = needs_event ? fmi2True : fmi2False;
    *terminateSimulation = fmi2False;
    return fmi2OK;
}

fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time) {
    return set_time(c, time);
}

fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t nx) {
    return set_states(c, x, nx);
}

fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real derivatives[], size_t nx) {
    return get_derivatives(c, CALL_GetDerivatives, derivatives, nx);
}

fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real eventIndicators[], size_t ni) {
    return get_indicators(c, eventIndicators, ni);
}

fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t nx) {
    return get_states(c, x, nx);
}

fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real x_nominal[], size_t nx) {
    return get_nominals(c, x_nominal, nx);
}
