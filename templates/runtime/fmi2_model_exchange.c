/* Model exchange (FMI 2.0, section 3.2). There are no events of the mechanism: no event indicators,
   no discrete states. */
#include <math.h>
#include <string.h>

#include "equations.h"
#include "instance.h"
#include "logging.h"
#include "system.h"
#if N_CONSTRAINTS > 0
#include "constraint_projection.h"
#endif
#if N_MASSLESS > 0
#include "massless.h"
#endif

/* fmi2OK if an array over the continuous states is there and has their number. */
static fmi2Status check_size(Instance *instance, const void *array, size_t nx) {
    if (nx != N_CONTINUOUS) {
        return fail(instance, "the array has %u elements; expected one for each of the %d continuous states",
                    (unsigned)nx, N_CONTINUOUS);
    }
    return array != NULL ? fmi2OK : fail(instance, "the array of %d elements is NULL", N_CONTINUOUS);
}

#if N_CONSTRAINTS > 0
/* The stabilised accelerations keep the drift at the importer's tolerance. Where that was not enough, by this factor,
   the states are pulled back by an event. */
static const double TOLERATED_DRIFT = 1e3;

static bool drifted(const Instance *instance) {
    const State *state = &instance->state;
    const double tolerance = state->tolerance > 0.0 ? state->tolerance : 1e-6;
    return constraints_drift(instance, state->time, state->states, state->inputs) > TOLERATED_DRIFT * tolerance;
}

/* What has no mass gives way to a force at once, and takes along what hangs on it but for what has mass: after a change
   of inputs or parameters it has to be sought, by a projection in the metric M, from where it was before. */
static bool displaced(Instance *instance) {
#if N_MASSLESS > 0
    State *state = &instance->state;
    if (state->displaced) {
        massless_return(state);
        state->settled = 0;
        instance_forget_motion(instance);
        return true;
    }
#else
    (void)instance;
#endif
    return false;
}

/* A step or an event begins or ends: what has no mass is where it is sought from later on. */
static void keep(Instance *instance) {
#if N_MASSLESS > 0
    massless_keep(&instance->state);
    instance->state.displaced = 0;
#else
    (void)instance;
#endif
}

static fmi2Status pull_back(Instance *instance, fmi2EventInfo *eventInfo) {
    State *state = &instance->state;
    double states[N_STATES];
    bool moved = false;
    if (!displaced(instance)) {
        if (!equations_massless(instance)) {
            return report_failure(instance, fmi2Error);
        }
        if (!drifted(instance)) {
            return fmi2OK;
        }
    }
    memcpy(states, state->states, sizeof states);
    if (!constraints_project(instance, state->time, state->inputs, states, &moved)) {
        return report_failure(instance, fmi2Error);
    }
    for (int i = 0; i < N_CONTINUOUS; i++) {
        const int k = CONTINUOUS_STATES[i];
        if (memcmp(&states[k], &state->states[k], sizeof(double)) != 0) {
            eventInfo->valuesOfContinuousStatesChanged = fmi2True;
        }
    }
    for (int i = 0; i < N_STATES; i++) {
        instance_assign(instance, &state->states[i], states[i]);
    }
    keep(instance);
    return fmi2OK;
}

/* Brings what is remembered from step to step up to date; no state is changed. What cannot be solved for here says so
   when it is asked for. */
static void end_step(Instance *instance, fmi2Boolean *enterEventMode) {
    if (equations_massless(instance)) {
        keep(instance);
        equations_remember(instance);
        *enterEventMode = drifted(instance) ? fmi2True : fmi2False;
    }
}
#endif

fmi2Status fmi2EnterEventMode(fmi2Component c) {
    Instance *instance = instance_enter(c, CALL_EnterEventMode);
    if (instance == NULL) {
        return fmi2Error;
    }
    instance->state.mode = MODE_EVENT;
#if N_CONSTRAINTS > 0
    if (equations_massless(instance)) {
        keep(instance);
    }
#endif
    return fmi2OK;
}

fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *eventInfo) {
    Instance *instance = instance_enter(c, CALL_NewDiscreteStates);
    if (instance == NULL) {
        return fmi2Error;
    }
    if (eventInfo == NULL) {
        return fail(instance, "the argument eventInfo is NULL; expected the address of an fmi2EventInfo");
    }
    memset(eventInfo, 0, sizeof *eventInfo); /* all flags fmi2False, no next event */
#if N_CONSTRAINTS > 0
    return pull_back(instance, eventInfo);
#else
    return fmi2OK;
#endif
}

fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c) {
    Instance *instance = instance_enter(c, CALL_EnterContinuousTimeMode);
    if (instance == NULL) {
        return fmi2Error;
    }
    instance->state.mode = MODE_CONTINUOUS_TIME;
#if N_CONSTRAINTS > 0
    equations_remember(instance);
#endif
    return fmi2OK;
}

fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean noSetFMUStatePriorToCurrentPoint,
                                       fmi2Boolean *enterEventMode, fmi2Boolean *terminateSimulation) {
    Instance *instance = instance_enter(c, CALL_CompletedIntegratorStep);
    (void)noSetFMUStatePriorToCurrentPoint; /* nothing is kept for going back */
    if (instance == NULL) {
        return fmi2Error;
    }
    if (enterEventMode == NULL || terminateSimulation == NULL) {
        return fail(instance, "the argument %s is NULL; expected the address of an fmi2Boolean",
                    enterEventMode == NULL ? "enterEventMode" : "terminateSimulation");
    }
    *enterEventMode = fmi2False;
    *terminateSimulation = fmi2False;
#if N_CONSTRAINTS > 0
    end_step(instance, enterEventMode);
#endif
    return fmi2OK;
}

/* A time after the stop time is accepted: integrators step over the end and interpolate. */
fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time) {
    Instance *instance = instance_enter(c, CALL_SetTime);
    if (instance == NULL) {
        return fmi2Error;
    }
    if (!isfinite(time)) {
        return fail(instance, "the time is %g; expected a finite number", time);
    }
    instance_assign(instance, &instance->state.time, time);
    return fmi2OK;
}

/* States that are not finite are discarded, not an error: the importer's integrator then tries a smaller step. */
fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t nx) {
    Instance *instance = instance_enter(c, CALL_SetContinuousStates);
    if (instance == NULL || check_size(instance, x, nx) != fmi2OK) {
        return fmi2Error;
    }
    for (int i = 0; i < N_CONTINUOUS; i++) {
        if (!isfinite(x[i])) {
            return discard(instance, "the state %s cannot be set to %g; expected a finite number, and nothing was set",
                           state_name(CONTINUOUS_STATES[i]), x[i]);
        }
    }
    for (int i = 0; i < N_CONTINUOUS; i++) {
        instance_assign(instance, &instance->state.states[CONTINUOUS_STATES[i]], x[i]);
    }
    return fmi2OK;
}

fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real derivatives[], size_t nx) {
    Instance *instance = instance_enter(c, CALL_GetDerivatives);
    if (instance == NULL || check_size(instance, derivatives, nx) != fmi2OK) {
        return fmi2Error;
    }
    if (!equations_settle(instance)) {
        return report_failure(instance, fmi2Error);
    }
    if (!equations_accelerations(instance)) {
        return report_failure(instance, fmi2Discard);
    }
    for (int i = 0; i < N_CONTINUOUS; i++) {
        const int state = CONTINUOUS_STATES[i];
        derivatives[i] = state < N_COORDINATES ? instance->state.states[N_COORDINATES + state]
                                               : instance->cache.accelerations[state - N_COORDINATES];
    }
    if (!instance->noted_singularity && system_runs_into_singularity(instance, instance->cache.accelerations)) {
        instance->noted_singularity = true;
        report_failure(instance, fmi2Warning); /* the derivatives are right: some importers end a run at fmi2Warning */
    }
    return fmi2OK;
}

fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real eventIndicators[], size_t ni) {
    Instance *instance = instance_enter(c, CALL_GetEventIndicators);
    (void)eventIndicators;
    if (instance == NULL) {
        return fmi2Error;
    }
    return ni == 0 ? fmi2OK : fail(instance, "this FMU has no event indicators; expected none, but got %u",
                                   (unsigned)ni);
}

fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t nx) {
    Instance *instance = instance_enter(c, CALL_GetContinuousStates);
    if (instance == NULL || check_size(instance, x, nx) != fmi2OK) {
        return fmi2Error;
    }
    if (!equations_settle(instance)) {
        return report_failure(instance, fmi2Error);
    }
    for (int i = 0; i < N_CONTINUOUS; i++) {
        x[i] = instance->state.states[CONTINUOUS_STATES[i]];
    }
    return fmi2OK;
}

fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real x_nominal[], size_t nx) {
    Instance *instance = instance_enter(c, CALL_GetNominalsOfContinuousStates);
    if (instance == NULL || check_size(instance, x_nominal, nx) != fmi2OK) {
        return fmi2Error;
    }
    for (int i = 0; i < N_CONTINUOUS; i++) {
        x_nominal[i] = NOMINAL_STATES[CONTINUOUS_STATES[i]];
    }
    return fmi2OK;
}
