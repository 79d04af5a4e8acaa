/* Event mode and triggered clocks (FMI 3.0, sections 2.2.9 and 2.3.5). An event may take two instants of super-dense
   time: in the first one fmi3UpdateDiscreteStates passes the event, in the second one the clocks of the contacts that
   have met in it are active. */
#include <math.h>
#include <string.h>

#include "integrator.h"
#include "logging.h"
#include "model_exchange.h"
#include "notices.h"
#include "port_access.h"

/* Lets the clocks of the contacts tick that have had impacts since the last time. Returns whether one does. */
static bool update_clocks(Component *component) {
    Session *session = &component->session;
    bool ticks = false;
    for (int i = 0; i < N_UNILATERALS; i++) {
        const int64_t impacts = component->instance.state.impacts[i];
        session->ticking[i] = impacts > session->counted[i];
        session->counted[i] = impacts;
        ticks = ticks || session->ticking[i];
    }
    return ticks;
}

fmi3Status fmi3EnterEventMode(fmi3Instance instance) {
    Component *component = enter_present(instance, CALL_EnterEventMode);
    if (component == NULL) {
        return fmi3Error;
    }
    update_clocks(component);
    memset(component->session.ticking, 0, sizeof component->session.ticking);
    component->session.reinitialized = 0;
    if (component->type == MODEL_EXCHANGE) {
        return enter_event_mode(component);
    }
    if (!component->importer.event_mode_used) {
        return fail(component, "the instance was made without eventModeUsed, so that it passes its events by itself");
    }
    set_mode(component, MODE_EVENT);
    return fmi3OK;
}

/* Passes the event that a communication step ended at, and what the importer changed in event mode. */
static fmi3Status settle_event(Component *component) {
    if (!integrator_settle(&component->instance)) {
        return report_failure(component, fmi3Error);
    }
    report_notices(component);
    return fmi3OK;
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean *discreteStatesNeedUpdate,
                                    fmi3Boolean *terminateSimulation, fmi3Boolean *nominalsOfContinuousStatesChanged,
                                    fmi3Boolean *valuesOfContinuousStatesChanged, fmi3Boolean *nextEventTimeDefined,
                                    fmi3Float64 *nextEventTime) {
    Component *component = enter_present(instance, CALL_UpdateDiscreteStates);
    bool changed = false;
    double next = HUGE_VAL;
    if (component == NULL) {
        return fmi3Error;
    }
    if (discreteStatesNeedUpdate == NULL || terminateSimulation == NULL ||
        nominalsOfContinuousStatesChanged == NULL || valuesOfContinuousStatesChanged == NULL ||
        nextEventTimeDefined == NULL || nextEventTime == NULL) {
        return fail(component, "an argument is NULL; expected the addresses of six results");
    }
    if ((component->type == MODEL_EXCHANGE ? update_states(component, &changed, &next) : settle_event(component)) !=
        fmi3OK) {
        return fmi3Error;
    }
    component->session.reinitialized = component->session.reinitialized || changed;
    *discreteStatesNeedUpdate = update_clocks(component);
    *terminateSimulation = false;
    *nominalsOfContinuousStatesChanged = false;
    *valuesOfContinuousStatesChanged = component->session.reinitialized != 0;
    *nextEventTimeDefined = isfinite(next);
    *nextEventTime = isfinite(next) ? next : 0.0;
    return fmi3OK;
}

/* providesEvaluateDiscreteStates is false, and enter() says that the call is illegal. */
fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance instance) {
    enter(instance, CALL_EvaluateDiscreteStates);
    return fmi3Error;
}

fmi3Status fmi3GetClock(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                        fmi3Clock values[]) {
    Component *component = enter(instance, CALL_GetClock);
    if (component == NULL ||
        check_ports(component, valueReferences, nValueReferences, &CLOCK, values, nValueReferences) != fmi3OK) {
        return fmi3Error;
    }
    const bool event = component->session.mode == MODE_EVENT;
    for (size_t i = 0; i < nValueReferences; i++) {
        values[i] = event && component->session.ticking[VARIABLES[PORTS[valueReferences[i]].first].index];
    }
    return fmi3OK;
}

/* All clocks are local. */
fmi3Status fmi3SetClock(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                        const fmi3Clock values[]) {
    Component *component = enter(instance, CALL_SetClock);
    if (component == NULL ||
        check_ports(component, valueReferences, nValueReferences, &CLOCK, values, nValueReferences) != fmi3OK) {
        return fmi3Error;
    }
    return nValueReferences == 0 ? fmi3OK
                                 : fail(component, "the clock %s ticks by itself and cannot be set",
                                        PORTS[valueReferences[0]].name);
}
