/* Co-simulation (FMI 3.0, section 4.2). If the importer uses event mode and allows early return, a communication step
   ends at the first event, which fmi3UpdateDiscreteStates passes; else events are passed within the step. */
#include <math.h>

#include "communication_step.h"
#include "diagnosis.h"
#include "integrator.h"
#include "intermediate_update.h"
#include "life.h"
#include "logging.h"
#include "observer.h"
#include "output_derivatives.h"
#include "port_access.h"
#include "scale.h"

fmi3Instance fmi3InstantiateCoSimulation(fmi3String instanceName, fmi3String instantiationToken,
                                         fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn,
                                         fmi3Boolean eventModeUsed, fmi3Boolean earlyReturnAllowed,
                                         const fmi3ValueReference requiredIntermediateVariables[],
                                         size_t nRequiredIntermediateVariables,
                                         fmi3InstanceEnvironment instanceEnvironment,
                                         fmi3LogMessageCallback logMessage,
                                         fmi3IntermediateUpdateCallback intermediateUpdate) {
    (void)resourcePath; /* all data is compiled in */
    (void)visible;
    Importer importer = {.environment = instanceEnvironment,
                         .log_message = logMessage,
                         .intermediate_update = intermediateUpdate,
                         .event_mode_used = eventModeUsed,
                         .early_return_allowed = earlyReturnAllowed};
    if (!names_fit(&importer, instanceName, instantiationToken, "instantiation token") ||
        !announce_intermediate(&importer, instanceName, requiredIntermediateVariables,
                               nRequiredIntermediateVariables)) {
        return NULL;
    }
    Component *component = component_new(&importer, CO_SIMULATION, instanceName, loggingOn);
    if (component != NULL) {
        component->instance.listener.awaits_events = eventModeUsed && earlyReturnAllowed;
        offer_updates(component);
    }
    return component;
}

fmi3Status fmi3EnterStepMode(fmi3Instance instance) {
    Component *component = enter(instance, CALL_EnterStepMode);
    if (component == NULL) {
        return fmi3Error;
    }
    set_mode(component, MODE_STEP);
    return fmi3OK;
}

/* Takes a communication step of length step (s) from the communication point (s), with all checks. A step that cannot
   be completed is an error: where the solver gave up is not where it began. */
static fmi3Status take_fmi3_step(fmi3Instance instance, double point, double step) {
    Component *component = enter(instance, CALL_DoStep);
    char sentence[SENTENCE_SIZE];
    if (component == NULL) {
        return fmi3Error;
    }
    if (!communication_step_possible(&component->instance, point, step, sentence, sizeof sentence)) {
        return fail(component, "%s", sentence);
    }
    if (!ask_for_inputs(component, point + step - component->instance.state.time)) {
        return fmi3Error;
    }
    if (!observer_advance(&component->instance, point + step)) {
        explain_failure(&component->instance);
        return report_failure(component, fmi3Error);
    }
    if (component->session.mode != MODE_STEP) { /* an error in an intermediate update */
        return fmi3Error;
    }
    report_notices(component);
    return fmi3OK;
}

/* The most frequent step, see integrator_pass. */
static bool pass(Component *component, double point, double step) {
    return component != NULL && component->session.mode == MODE_STEP && !component->logging && step > 0.0 &&
           !component->importer.sets_inputs &&
           fabs(point - component->instance.state.time) <= COMMUNICATION_POINT * step &&
           integrator_pass(&component->instance, point + step);
}

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 currentCommunicationPoint, fmi3Float64 communicationStepSize,
                      fmi3Boolean noSetFMUStatePriorToCurrentPoint, fmi3Boolean *eventHandlingNeeded,
                      fmi3Boolean *terminateSimulation, fmi3Boolean *earlyReturn, fmi3Float64 *lastSuccessfulTime) {
    (void)noSetFMUStatePriorToCurrentPoint; /* no earlier point is kept, so this allows nothing */
    Component *component = (Component *)instance;
    fmi3Status status = fmi3OK;
    if (component != NULL && (eventHandlingNeeded == NULL || terminateSimulation == NULL || earlyReturn == NULL ||
                              lastSuccessfulTime == NULL)) {
        return enter(component, CALL_DoStep) == NULL
                   ? fmi3Error
                   : fail(component, "an argument is NULL; expected the addresses of four results");
    }
    if (!pass(component, currentCommunicationPoint, communicationStepSize)) {
        status = take_fmi3_step(component, currentCommunicationPoint, communicationStepSize);
    }
    if (component != NULL) {
        const State *state = &component->instance.state;
        *eventHandlingNeeded = state->event_held != 0;
        *terminateSimulation = false;
        *earlyReturn = state->time < currentCommunicationPoint + communicationStepSize;
        *lastSuccessfulTime = state->time;
    }
    return status;
}

fmi3Status fmi3GetOutputDerivatives(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                                    size_t nValueReferences, const fmi3Int32 orders[], fmi3Float64 values[],
                                    size_t nValues) {
    Component *component = enter_present(instance, CALL_GetOutputDerivatives);
    int needed = -1;
    double value;
    if (component == NULL ||
        check_ports(component, valueReferences, nValueReferences, &FLOAT64, values, nValues) != fmi3OK ||
        check_intermediate(component, valueReferences, nValueReferences, false) != fmi3OK) {
        return fmi3Error;
    }
    if (nValueReferences > 0 && orders == NULL) {
        return fail(component, "the array of %u orders is NULL", (unsigned)nValueReferences);
    }
    Elements elements = elements_of(valueReferences), second = elements, third = elements;
    for (size_t i = 0; i < nValues; i++) {
        const Variable *variable = next_element(&elements);
        if (check_output(component, variable, orders[elements.port], &needed) != fmi3OK) {
            return fmi3Error;
        }
    }
    if (nValues > 0 && find_motion(component, needed, &component->motion) != fmi3OK) {
        return fmi3Error;
    }
    for (size_t i = 0; i < nValues; i++) {
        const Variable *variable = next_element(&second);
        if (read_motion(component, &component->motion, variable, orders[second.port], &value) != fmi3OK) {
            return fmi3Error;
        }
    }
    for (size_t i = 0; i < nValues; i++) {
        const Variable *variable = next_element(&third);
        read_motion(component, &component->motion, variable, orders[third.port], &values[i]);
    }
    return fmi3OK;
}
