/* Communication steps: what they are checked for, and what is said of them. */
#include "communication_step.h"

#include <float.h>
#include <math.h>
#include <stdio.h>

#include "integrator.h"
#include "logging.h"
#include "solver.h"
#include "system.h"

/* A stop time may be passed by this part of the communication step. */
static const double STOP_TIME_TOLERANCE = 1e-6;
#if N_VIBRATIONS > 0
enum { VIBRATIONS_SHOWN = 3 }; /* of those that are not resolved, the fastest ones */
#endif

/* 64 units in the last place of a time. */
static double rounding(double time) {
    return 64.0 * DBL_EPSILON * fabs(time);
}

/* fmi2OK if a communication step of this length (s) may start at this communication point (s). */
static fmi2Status check_step(Instance *instance, double point, double step) {
    const State *state = &instance->state;
    if (!(step > 0.0) || !isfinite(step)) {
        return fail(instance, "the communication step is %.17g s; expected a positive number", step);
    }
    if (!(fabs(point - state->time) <= COMMUNICATION_POINT_TOLERANCE * step + rounding(state->time))) {
        return fail(instance, "the communication point is %.17g s; expected the end of the last step, %.17g s, to "
                    "within %g of the communication step %.17g s", point, state->time, COMMUNICATION_POINT_TOLERANCE,
                    step);
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
static void warn_unresolved(Instance *instance, const Notice *notice) {
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
    const double enough = 0.4 * RESOLVING_STEP(VIBRATIONS[0]);
    if (IMPLICIT) {
        warn(instance, "solver %s damps undamped vibrations at time %.17g s, where its step of %.3g s is longer than an "
             "eighth of a period: %s; if they matter, set solver_max_step to %.2g s", METHOD.name, notice->time,
             notice->step, list, enough);
    } else {
        warn(instance, "solver %s gets vibrations wrong, or is unstable, at time %.17g s, where its step of %.3g s is "
             "longer than an eighth of a period: %s; set solver_step to %.2g s, or export with --solver dopri5",
             METHOD.name, notice->time, notice->step, list, enough);
    }
#else
    (void)instance;
    (void)notice;
#endif
}

static void warn_stiff(Instance *instance, const Notice *notice) {
    if (IMPLICIT) {
        warn(instance, "the mechanism is too stiff at time %.17g s for a solver step of %.3g s: its stiff directions turn "
             "too far in it for solver %s, whose results are wrong then; lower solver_step, or export with --solver "
             "radau5", notice->time, notice->step, METHOD.name);
    } else if (METHOD.error_order == 0) {
        warn(instance, "the mechanism is too stiff at time %.17g s for a solver step of %.3g s: solver %s is not stable "
             "with it; lower solver_step, or export with --solver ros2 or radau5", notice->time, notice->step,
             METHOD.name);
    } else {
        warn(instance, "the mechanism is stiff at time %.17g s: stability, not accuracy, bounds the steps of solver %s, "
             "to %.3g s there; export with --solver radau5", notice->time, METHOD.name, notice->step);
    }
}

/* Reports a motion input of which only the position moves. */
static void warn_motion(Instance *instance, const Notice *notice) {
    const int input = FIRST_MOTION + 3 * notice->index;
    warn(instance, "the input %s moves at time %.17g s, but %s and %s stay 0: the equations take the support as resting; "
         "connect all three, or set derivatives for all three", variable_name(VARIABLE_INPUT, input), notice->time,
         variable_name(VARIABLE_INPUT, input + 1), variable_name(VARIABLE_INPUT, input + 2));
}

/* Reports a coordinate that left its range. */
static void warn_range(Instance *instance, const Notice *notice) {
#if N_BOUNDED > 0
    const double *range = RANGES[notice->index];
    warn(instance, "the coordinate %s leaves its range from %.6g to %.6g after time %.17g s; the bounds are no stops, and "
         "the motion goes on without them", state_name(BOUNDED[notice->index]), range[0], range[1], notice->time);
#else
    (void)instance;
    (void)notice;
#endif
}

/* Says what the solver noticed for the first time. The step is complete: some importers end a run at fmi2Warning. */
static void report_notice(Instance *instance) {
    const Notice *notice = &instance->notice;
    switch (notice->kind) {
    case NOTICE_STIFF:
        warn_stiff(instance, notice);
        break;
    case NOTICE_UNEQUAL:
        warn(instance, "the solver step changed to %.17g s at time %.17g s; solver %s keeps the energy bounded over long "
             "times with equal steps only: keep the communication steps equal", notice->step, notice->time,
             METHOD.name);
        break;
    case NOTICE_UNRESOLVED:
        warn_unresolved(instance, notice);
        break;
    case NOTICE_MOTION:
        warn_motion(instance, notice);
        break;
    case NOTICE_RANGE:
        warn_range(instance, notice);
        break;
    case NOTICE_NONE:
    default:
        break;
    }
}

fmi2Status communication_step(fmi2Component c, double point, double step) {
    Instance *instance = instance_enter(c, CALL_DoStep);
    if (instance == NULL || check_step(instance, point, step) != fmi2OK) {
        return fmi2Error;
    }
    if (!integrate(instance, point + step)) {
        instance->state.mode = MODE_STEP_FAILED;
        instance->state.step_failed = 1;
        system_explain_failure(instance);
        return report_failure(instance, fmi2Discard);
    }
    report_notice(instance);
    return fmi2OK;
}
