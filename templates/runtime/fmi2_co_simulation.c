/* Co-simulation (FMI 2.0, section 4.2). The instance works synchronously: a step is done when fmi2DoStep returns. */
#include <math.h>

#include "communication_step.h"
#include "instance.h"
#include "logging.h"

/* The most frequent communication step, made short work of: like the last one it ends within a solver step, and only
   the time moves. Such a solver step does not pass the stop time: that is the integrator's care. */
static bool moved_within_solver_step(Instance *instance, double point, double step) {
    const double end = point + step;
    const bool within = instance != NULL && instance->state.mode == MODE_STEP_COMPLETE &&
                        instance->cache.states_behind && step > 0.0 &&
                        fabs(point - instance->state.time) <= COMMUNICATION_POINT_TOLERANCE * step &&
                        end < instance->state.dense.end;
    if (within) {
        instance->state.time = end;
    }
    return within;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real currentCommunicationPoint, fmi2Real communicationStepSize,
                      fmi2Boolean noSetFMUStatePriorToCurrentPoint) {
    (void)noSetFMUStatePriorToCurrentPoint; /* nothing is kept for going back */
    if (moved_within_solver_step(c, currentCommunicationPoint, communicationStepSize)) {
        return fmi2OK;
    }
    return communication_step(c, currentCommunicationPoint, communicationStepSize);
}

fmi2Status fmi2CancelStep(fmi2Component c) {
    instance_enter(c, CALL_CancelStep); /* legal while a step is in progress only, and none ever is: reports an error */
    return fmi2Error;
}

/* The common body of the status functions: NULL if value is NULL or the call illegal. */
static Instance *enter_status(fmi2Component c, Call call, const void *value) {
    Instance *instance = instance_enter(c, call);
    if (instance != NULL && value == NULL) {
        fail(instance, "the argument value is NULL; expected an address");
        return NULL;
    }
    return instance;
}

/* The answer to a question that has none in a synchronous FMU (section 4.2.3). */
static fmi2Status no_status(Instance *instance, fmi2StatusKind kind) {
    return discard(instance, "there is no status of kind %d; only fmi2LastSuccessfulTime (2, Real) and fmi2Terminated "
                   "(3, Boolean) are answered, because fmi2DoStep never returns fmi2Pending", (int)kind);
}

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind s, fmi2Status *value) {
    Instance *instance = enter_status(c, CALL_GetStatus, value);
    return instance == NULL ? fmi2Error : no_status(instance, s);
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind s, fmi2Real *value) {
    Instance *instance = enter_status(c, CALL_GetRealStatus, value);
    if (instance == NULL) {
        return fmi2Error;
    }
    if (s != fmi2LastSuccessfulTime) {
        return no_status(instance, s);
    }
    *value = instance->state.time;
    return fmi2OK;
}

fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind s, fmi2Integer *value) {
    Instance *instance = enter_status(c, CALL_GetIntegerStatus, value);
    return instance == NULL ? fmi2Error : no_status(instance, s);
}

/* A failed step cannot be completed with a shorter communication step either: the solver has tried that already. */
fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind s, fmi2Boolean *value) {
    Instance *instance = enter_status(c, CALL_GetBooleanStatus, value);
    if (instance == NULL) {
        return fmi2Error;
    }
    if (s != fmi2Terminated) {
        return no_status(instance, s);
    }
    *value = instance->state.step_failed ? fmi2True : fmi2False;
    return fmi2OK;
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind s, fmi2String *value) {
    Instance *instance = enter_status(c, CALL_GetStringStatus, value);
    return instance == NULL ? fmi2Error : no_status(instance, s);
}
