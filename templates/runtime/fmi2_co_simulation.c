/* Co-simulation (FMI 2.0, section 4.2). The instance works synchronously: a step is done when fmi2DoStep returns. */
#include <float.h>
#include <math.h>
#include <stdio.h>

#include "instance.h"
#include "integrator.h"
#include "logging.h"
#include "solver.h"
#include "system.h"

/* Importers compute times in many ways, so times are never compared exactly: a difference of this part of the
   communication step is bridged, and a stop time may be passed by that part. */
static const double TIME_TOLERANCE = 1e-3;
static const double STOP_TIME_TOLERANCE = 1e-6;
#if N_VIBRATIONS > 0
enum { VIBRATIONS_SHOWN = 3 }; /* of those that are damped, the fastest ones */
#endif

/* 64 units in the last place of a time. */
static double rounding(double time) {
    return 64.0 * DBL_EPSILON * fabs(time);
}

/* The most frequent communication step, made short work of: like the last one it ends within a solver step, and only
   the time moves. Such a solver step does not pass the stop time: that is the integrator's care. */
static bool moved_within_solver_step(Instance *instance, double point, double step) {
    const double end = point + step;
    const bool within = instance != NULL && instance->state.mode == MODE_STEP_COMPLETE &&
                        instance->cache.states_behind && step > 0.0 &&
                        fabs(point - instance->state.time) <= TIME_TOLERANCE * step && end < instance->state.dense.end;
    if (within) {
        instance->state.time = end;
    }
    return within;
}

/* fmi2OK if a communication step of this length (s) may start at this communication point (s). */
static fmi2Status check_step(Instance *instance, double point, double step) {
    const State *state = &instance->state;
    if (!(step > 0.0) || !isfinite(step)) {
        return fail(instance, "the communication step is %.17g s; expected a positive number", step);
    }
    if (!(fabs(point - state->time) <= TIME_TOLERANCE * step + rounding(state->time))) {
        return fail(instance, "the communication point is %.17g s; expected the end of the last step, %.17g s, to "
                    "within %g of the communication step %.17g s", point, state->time, TIME_TOLERANCE, step);
    }
    if (!isfinite(point + step)) {
        return fail(instance, "the communication step from %.17g s by %.17g s has no finite end", point, step);
    }
    if (state->stop_time_defined &&
        point + step > state->stop_time + STOP_TIME_TOLERANCE * step + rounding(state->stop_time)) {
        return fail(instance, "the communication step would end at %.17g s; expected no time after the stop time "
                    "%.17g s of fmi2SetupExperiment", point + step, state->stop_time);
    }
    return fmi2OK;
}

/* Reports the vibrations that are faster than steps of this length (s) resolve, and how to keep them. */
static fmi2Status warn_damped(Instance *instance, const Notice *notice) {
#if N_VIBRATIONS > 0
    char list[400] = "";
    size_t used = 0;
    int count = 0;
    for (; count < N_VIBRATIONS && notice->step > RESOLVING_STEP(VIBRATIONS[count]); count++) {
        if (count < VIBRATIONS_SHOWN && used < sizeof list) {
            const int written = snprintf(list + used, sizeof list - used, "%s%.3g rad/s (%.80s)", count > 0 ? ", " : "",
                                         VIBRATIONS[count], COORDINATE_NAMES[VIBRATING[count]]);
            used += written > 0 ? (size_t)written : 0;
        }
    }
    if (count > VIBRATIONS_SHOWN && used < sizeof list) {
        snprintf(list + used, sizeof list - used, " and %d slower ones", count - VIBRATIONS_SHOWN);
    }
    return warn(instance, "solver %s damps undamped vibrations at time %.17g s, where its step of %.3g s is longer "
                "than an eighth of a period: %s; if they matter, set solver_max_step to %.2g s", METHOD.name,
                notice->time, notice->step, list, 0.4 * RESOLVING_STEP(VIBRATIONS[0]));
#else
    (void)instance;
    (void)notice;
    return fmi2OK;
#endif
}

/* fmi2OK, or fmi2Warning where the solver noticed something for the first time. */
static fmi2Status report_notice(Instance *instance) {
    const Notice *notice = &instance->notice;
    switch (notice->kind) {
    case NOTICE_STIFF:
        if (IMPLICIT) {
            return warn(instance, "the mechanism is too stiff at time %.17g s for a solver step of %.3g s: its stiff "
                        "directions turn too far in it for solver %s, whose results are wrong then; lower solver_step, or "
                        "export with --solver radau5", notice->time, notice->step, METHOD.name);
        }
        if (METHOD.error_order == 0) {
            return warn(instance, "the mechanism is too stiff at time %.17g s for a solver step of %.3g s: solver %s "
                        "is not stable with it; lower solver_step, or export with --solver ros2 or radau5",
                        notice->time, notice->step, METHOD.name);
        }
        return warn(instance, "the mechanism is stiff at time %.17g s: stability, not accuracy, bounds the steps of "
                    "solver %s, to %.3g s there; export with --solver radau5", notice->time, METHOD.name, notice->step);
    case NOTICE_UNEQUAL:
        return warn(instance, "the solver step changed to %.17g s at time %.17g s; solver %s keeps the energy bounded "
                    "over long times with equal steps only: keep the communication steps equal", notice->step,
                    notice->time, METHOD.name);
    case NOTICE_DAMPED:
        return warn_damped(instance, notice);
    case NOTICE_NONE:
    default:
        return fmi2OK;
    }
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real currentCommunicationPoint, fmi2Real communicationStepSize,
                      fmi2Boolean noSetFMUStatePriorToCurrentPoint) {
    (void)noSetFMUStatePriorToCurrentPoint; /* nothing is kept for going back */
    if (moved_within_solver_step(c, currentCommunicationPoint, communicationStepSize)) {
        return fmi2OK;
    }
    Instance *instance = instance_enter(c, CALL_DoStep);
    if (instance == NULL || check_step(instance, currentCommunicationPoint, communicationStepSize) != fmi2OK) {
        return fmi2Error;
    }
    if (!integrate(instance, currentCommunicationPoint + communicationStepSize)) {
        instance->state.mode = MODE_STEP_FAILED;
        instance->state.step_failed = 1;
        system_explain_failure(instance);
        return report_failure(instance, fmi2Discard);
    }
    return report_notice(instance);
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
