/* Co-simulation (FMI 2.0, section 4.2). The instance works synchronously: a step is done when fmi2DoStep returns. */
#include <math.h>

#include "communication_step.h"
#include "diagnosis.h"
#include "gate.h"
#include "integrator.h"
#include "logging.h"
#include "observer.h"
#include "scale.h"

/* Takes a communication step of length step (s) from the communication point (s), with all checks. Returns fmi2Error
   for an illegal call and for a step that cannot start, fmi2Discard for one that the solver cannot complete. */
static fmi2Status take_fmi2_step(fmi2Component c, double point, double step) {
    Component *component = enter(c, CALL_DoStep);
    char sentence[SENTENCE_SIZE];
    if (component == NULL) {
        return fmi2Error;
    }
    if (!communication_step_possible(&component->instance, point, step, sentence, sizeof sentence)) {
        return fail(component, "%s", sentence);
    }
    if (!observer_advance(&component->instance, point + step)) {
        set_mode(component, MODE_STEP_FAILED);
        component->session.step_failed = 1;
        explain_failure(&component->instance);
        return report_failure(component, fmi2Discard);
    }
    report_notices(component);
    return fmi2OK;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real currentCommunicationPoint, fmi2Real communicationStepSize,
                      fmi2Boolean noSetFMUStatePriorToCurrentPoint) {
    (void)noSetFMUStatePriorToCurrentPoint; /* no earlier point is kept, so this allows nothing */
    const double point = currentCommunicationPoint, step = communicationStepSize;
    Component *component = (Component *)c;
    const bool usual = component != NULL && component->session.mode == MODE_STEP_COMPLETE && !component->logging &&
                       step > 0.0 &&
                       fabs(point - component->instance.state.time) <= COMMUNICATION_POINT * step;
    return usual && integrator_pass(&component->instance, point + step) ? fmi2OK : take_fmi2_step(c, point, step);
}

fmi2Status fmi2CancelStep(fmi2Component c) {
    enter(c, CALL_CancelStep); /* legal only while a step is in progress, which never happens here: reports an error */
    return fmi2Error;
}

/* The answer to a question that has none in a synchronous FMU (section 4.2.3). */
static fmi2Status no_status(Component *component, fmi2StatusKind kind) {
    return discard(component, "there is no status of kind %d; only fmi2LastSuccessfulTime (2, Real) and fmi2Terminated "
                   "(3, Boolean) are answered, because fmi2DoStep never returns fmi2Pending", (int)kind);
}

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind s, fmi2Status *value) {
    Component *component = enter_with(c, CALL_GetStatus, value, "value");
    return component == NULL ? fmi2Error : no_status(component, s);
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind s, fmi2Real *value) {
    Component *component = enter_with(c, CALL_GetRealStatus, value, "value");
    if (component == NULL) {
        return fmi2Error;
    }
    if (s != fmi2LastSuccessfulTime) {
        return no_status(component, s);
    }
    *value = component->instance.state.time;
    return fmi2OK;
}

fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind s, fmi2Integer *value) {
    Component *component = enter_with(c, CALL_GetIntegerStatus, value, "value");
    return component == NULL ? fmi2Error : no_status(component, s);
}

/* A failed step cannot be completed with a shorter communication step either: the solver has tried that already. */
fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind s, fmi2Boolean *value) {
    Component *component = enter_with(c, CALL_GetBooleanStatus, value, "value");
    if (component == NULL) {
        return fmi2Error;
    }
    if (s != fmi2Terminated) {
        return no_status(component, s);
    }
    *value = component->session.step_failed ? fmi2True : fmi2False;
    return fmi2OK;
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind s, fmi2String *value) {
    Component *component = enter_with(c, CALL_GetStringStatus, value, "value");
    return component == NULL ? fmi2Error : no_status(component, s);
}
