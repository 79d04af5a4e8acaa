/* Model exchange (FMI 3.0, section 3.2). */
#include "logging.h"
#include "model_exchange.h"

fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance instance) {
    return enter_continuous_time_mode(instance);
}

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance instance, fmi3Boolean noSetFMUStatePriorToCurrentPoint,
                                       fmi3Boolean *enterEventMode, fmi3Boolean *terminateSimulation) {
    (void)noSetFMUStatePriorToCurrentPoint; /* no earlier point is kept, so this allows nothing */
    Component *component = enter(instance, CALL_CompletedIntegratorStep);
    if (component == NULL) {
        return fmi3Error;
    }
    if (enterEventMode == NULL || terminateSimulation == NULL) {
        return fail(component, "the argument %s is NULL; expected the address of an fmi3Boolean",
                    enterEventMode == NULL ? "enterEventMode" : "terminateSimulation");
    }
    *terminateSimulation = false;
    return complete_step(component, enterEventMode);
}

fmi3Status fmi3SetTime(fmi3Instance instance, fmi3Float64 time) {
    return set_time(instance, time);
}

fmi3Status fmi3SetContinuousStates(fmi3Instance instance, const fmi3Float64 continuousStates[],
                                   size_t nContinuousStates) {
    return set_states(instance, continuousStates, nContinuousStates);
}

fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance instance, fmi3Float64 derivatives[],
                                             size_t nContinuousStates) {
    return get_derivatives(instance, CALL_GetContinuousStateDerivatives, derivatives, nContinuousStates);
}

fmi3Status fmi3GetEventIndicators(fmi3Instance instance, fmi3Float64 eventIndicators[], size_t nEventIndicators) {
    return get_indicators(instance, eventIndicators, nEventIndicators);
}

fmi3Status fmi3GetContinuousStates(fmi3Instance instance, fmi3Float64 continuousStates[], size_t nContinuousStates) {
    return get_states(instance, continuousStates, nContinuousStates);
}

fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance instance, fmi3Float64 nominals[], size_t nContinuousStates) {
    return get_nominals(instance, nominals, nContinuousStates);
}

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance instance, size_t *nEventIndicators) {
    if (enter_with(instance, CALL_GetNumberOfEventIndicators, nEventIndicators, "nEventIndicators") == NULL) {
        return fmi3Error;
    }
    *nEventIndicators = N_EVENTS;
    return fmi3OK;
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance instance, size_t *nContinuousStates) {
    if (enter_with(instance, CALL_GetNumberOfContinuousStates, nContinuousStates, "nContinuousStates") == NULL) {
        return fmi3Error;
    }
    *nContinuousStates = N_CONTINUOUS;
    return fmi3OK;
}
