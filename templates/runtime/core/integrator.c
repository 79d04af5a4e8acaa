/* Step size control. Sources:
   [HNW]  Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, 2nd edition, section II.4;
   [HW]   Hairer, Wanner, Solving Ordinary Differential Equations II, 2nd edition, section IV.2 (the PI controller),
          with the constants of the code dopri5.f of the same authors. */
#include "integrator.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "constraints.h"
#include "dense_output.h"
#include "diagnosis.h"
#include "equations.h"
#include "inputs.h"
#include "notices.h"
#include "settings.h"

static const double LARGEST_GROWTH = 10.0;
static const double LARGEST_REDUCTION = 0.2;
static const double SMALLEST_ERROR = 1e-4; /* remembered by the controller */
static const double STRETCH = 1.05;        /* the last step may be this much longer, instead of leaving a sliver */
static const double MAX_STEP_SLACK = 1.001;
static const double WORTHWHILE = 1.25;     /* a step that would pass the communication point by less ends there */
static const double FARTHEST = 1000.0;     /* communication steps that a solver step may pass */
static const double LONGEST_PART = 0.02;   /* of the experiment, that a step takes under error control by default */
static const double RESTING_PART = 1e-7;   /* of the experiment: the first step where nothing moves */
static const double MOST_STEPS = 1e12;     /* of a fixed-step method in a communication step */
static const int64_t MOST_TRIALS = 10000000; /* of an adaptive method likewise, which may meet a motion that blows up */

/* fmin and fmax of the C library are calls, for the sake of NaN. */
static double smaller(double a, double b) {
    return a < b ? a : b;
}

static double larger(double a, double b) {
    return a > b ? a : b;
}

/* solver_max_step, s. If it is not given, the stages of longer steps could all miss what lasts for a short time only:
   a part of the experiment under error control, else infinite, for then the length is given. */
static double longest_step(const State *state) {
    const double setting = state->settings[SETTING_MAX_STEP];
    const double usual = METHOD.error_order > 0 ? LONGEST_PART * experiment_duration(state) : HUGE_VAL;
    return setting > 0.0 ? setting : usual;
}

/* The maximum of |v_i| / weight_i over the states, with the weights of the error estimate at the present point. */
static double weighted_norm(const State *state, const double v[]) {
    const double tolerance = solver_tolerance(state);
    double largest = 0.0;
    for (int i = 0; i < N_STATES; i++) {
        largest = larger(largest, fabs(v[i]) / (tolerance * (fabs(state->states[i]) + NOMINAL_STATES[i])));
    }
    return largest;
}

/* The exponent's denominator: the error estimate of a step h is proportional to h to this power. */
static double error_power(void) {
    return 1.0 + (METHOD.error_order < METHOD.order ? METHOD.error_order : METHOD.order);
}

/* The length of the very first step, s: [HNW], "Starting step size". */
static double first_step(Instance *instance) {
    const State *state = &instance->state;
    Scratch *scratch = &instance->scratch;
    const double d0 = weighted_norm(state, state->states);
    const double d1 = weighted_norm(state, state->first_stage);
    const double h0 = d0 < 1e-5 || d1 < 1e-5 ? RESTING_PART * experiment_duration(state) : 0.01 * d0 / d1;

    for (int i = 0; i < N_STATES; i++) {
        scratch->stage_states[i] = state->states[i] + h0 * state->first_stage[i];
    }
    if (!equations_derivative(instance, state->time + h0, scratch->stage_states, scratch->new_derivatives)) {
        return 1e-3 * h0;
    }
    for (int i = 0; i < N_STATES; i++) {
        scratch->new_derivatives[i] = (scratch->new_derivatives[i] - state->first_stage[i]) / h0;
    }
    const double largest = larger(d1, weighted_norm(state, scratch->new_derivatives));
    const double h1 = largest <= 1e-15 ? h0 : pow(0.01 / largest, 1.0 / error_power());
    return smaller(100.0 * h0, h1);
}

/* Moves states onto the constraints; *moved tells whether that changed them. */
static bool project(Instance *instance, double time, double states[], bool *moved) {
    return constraints_project(instance, time, inputs_at(instance, time), states, moved);
}

/* Moves states onto the constraints, and takes their derivatives anew if that changed them. */
static bool bring_back(Instance *instance, double time, double states[], double derivatives[]) {
    bool moved;
    return project(instance, time, states, &moved) &&
           (!moved || equations_derivative(instance, time, states, derivatives));
}

/* Makes state->first_stage the derivative at the present point, on the constraints as the inputs now move them. */
static bool update_first_stage(Instance *instance) {
    State *state = &instance->state;
    double *derivatives = instance->scratch.new_derivatives; /* which a failure may leave half done */
    if (!state->first_stage_valid) {
        if (!bring_back(instance, state->time, state->states, derivatives) ||
            !equations_derivative(instance, state->time, state->states, derivatives)) {
            return false;
        }
        memcpy(state->first_stage, derivatives, sizeof state->first_stage);
        state->first_stage_valid = 1;
    }
    return true;
}

/* Variational methods meet the constraints by themselves, with momenta that belong to these velocities. */
static bool bring_back_result(Instance *instance, Step step) {
    Scratch *scratch = &instance->scratch;
    return METHOD.variational || bring_back(instance, step.end, scratch->new_states, scratch->new_derivatives);
}

/* Makes the result of a trial step the present point. */
static void accept(Instance *instance, Step step) {
    State *state = &instance->state;
    state->time = step.end;
    memcpy(state->states, instance->scratch.new_states, sizeof state->states);
    memcpy(state->first_stage, instance->scratch.new_derivatives, sizeof state->first_stage);
    state->first_stage_valid = 1;
}

/* How far (s) steps may go: beyond the end of the communication step only if the same inputs may well hold there. They
   do not if they move, and are not expected to if something was changed before this communication step. Where the
   equations contain the time, the importer's steps tell how fast things change. */
static double horizon_of(const Instance *instance, double end) {
    const State *state = &instance->state;
    if (TIME_DEPENDENT || METHOD.dense_order == 0 || !state->undisturbed || instance->scratch.inputs_move) {
        return end;
    }
    const double farthest = end + FARTHEST * (end - state->time);
    return state->stop_time_defined ? larger(end, smaller(farthest, state->stop_time)) : farthest;
}

/* The states at a time (s) in the step of state->dense, on the constraints. */
static bool interpolate(Instance *instance, double time, double states[]) {
    bool moved;
    dense_states(&instance->state.dense, time, states);
    return project(instance, time, states, &moved);
}

/* Prepares interpolation for a step that goes beyond the communication point. That constraints can be met within it is
   tried where the interpolant is farthest from both ends: a shorter step is the remedy now, and none is left later. */
static bool prepare_interpolation(Instance *instance, Step step) {
    double states[N_STATES];
    return dense_begin(instance, step) &&
           (N_CONSTRAINTS == 0 || interpolate(instance, step.end - 0.5 * step.length, states));
}

bool integrator_catch_up(Instance *instance) {
    State *state = &instance->state;
    double states[N_STATES];
    if (instance->cache.states_behind) {
        if (!interpolate(instance, state->time, states)) {
            return false;
        }
        memcpy(state->states, states, sizeof states);
        instance->cache.states_behind = false;
    }
    return true;
}

/* The next trial step: as proposed, or to the end or the horizon if that is about as near. */
static Step choose_step(const State *state, double end, double horizon) {
    const double longest = longest_step(state);
    const double proposed = smaller(state->next_step, longest);
    const double near = end < horizon && end - state->time < proposed / WORTHWHILE ? horizon : end;
    const double remaining = near - state->time;
    if (remaining <= STRETCH * proposed && remaining <= MAX_STEP_SLACK * longest) {
        return (Step){remaining, near, remaining < proposed};
    }
    const double next = state->time + proposed;
    return (Step){next - state->time, next, false};
}

/* The proposal after an accepted step, the PI controller of [HW]: h (1/error)^alpha previous_error^beta, bounded. A
   step that was cut short by the end of the communication step says little and does not reduce the proposal. */
static void propose(State *state, Step step, double error, bool after_rejection) {
    const double beta = 0.2 / error_power();
    const double alpha = 1.0 / error_power() - 0.75 * beta;
    double factor = METHOD.safety * exp(beta * state->previous_log_error - alpha * log(error)); /* error 0: infinite */
    factor = smaller(larger(factor, LARGEST_REDUCTION), after_rejection ? 1.0 : LARGEST_GROWTH);
    if (step.cut_short) {
        state->next_step = larger(state->next_step, factor * step.length);
    } else {
        state->next_step = factor * step.length;
        state->previous_log_error = log(larger(error, SMALLEST_ERROR));
    }
}

/* The error of a trial step in units of the tolerance, HUGE_VAL if the step could not be computed. Above 1 the step
   is to be rejected and instance->failure holds the reason. */
static double try_step(Instance *instance, Step step) {
    int worst;
    instance->scratch.trial_length = step.length;
    if (!solver_step(instance, step)) {
        return HUGE_VAL;
    }
    const double error = solver_error(instance, step, solver_tolerance(&instance->state), &worst);
    if (!(error <= 1.0)) {
        Failure *failure = &instance->failure;
        failure->kind = FAILURE_ACCURACY;
        failure->time = instance->state.time;
        failure->state = worst;
        failure->amount = error;
        failure->step = step.length;
    }
    return isfinite(error) ? error : HUGE_VAL;
}

/* Adaptive steps to the end or beyond, with dense output for the one that goes beyond. Fails when the step would fall
   below 16 units in the last place of the time. */
static bool step_adaptively(Instance *instance, double end) {
    State *state = &instance->state;
    const double horizon = horizon_of(instance, end);
    bool rejected = false;
    int64_t trials = 0;
    if (!(state->next_step > 0.0)) {
        state->next_step = state->settings[SETTING_STEP] > 0.0 ? state->settings[SETTING_STEP] : first_step(instance);
    }
    while (state->time < end) {
        const double shortest = 16.0 * DBL_EPSILON * larger(fabs(state->time), fabs(end));
        state->next_step = larger(state->next_step, shortest);
        if (++trials > MOST_TRIALS) {
            instance->failure.kind = FAILURE_TRIAL_COUNT;
            instance->failure.time = state->time;
            instance->failure.amount = (double)MOST_TRIALS;
            return false;
        }
        const Step step = choose_step(state, end, horizon);
        const double error = try_step(instance, step);
        if (error <= 1.0 && bring_back_result(instance, step) &&
            (step.end <= end || prepare_interpolation(instance, step))) {
            propose(state, step, error, rejected);
            watch_stiffness(instance, step);
            watch_vibrations(instance, step.length);
            watch_ranges(instance, step);
            accept(instance, step);
            state->ahead = step.end > end;
            rejected = false;
        } else {
            const bool measured = error > 1.0 && isfinite(error);
            const double factor = measured ? METHOD.safety * pow(error, -1.0 / error_power()) : 0.25;
            rejected = true;
            state->next_step = step.length * larger(factor, LARGEST_REDUCTION);
            if (state->next_step < shortest) {
                return false;
            }
        }
    }
    return true;
}

/* Goes on from where the solver is. If that is beyond the end, the states at the end can be interpolated. */
static bool integrate_adaptively(Instance *instance, double end) {
    State *state = &instance->state;
    if (state->ahead && instance->scratch.inputs_move) {
        if (!integrator_catch_up(instance)) {
            return false;
        }
        state->ahead = 0;
        state->first_stage_valid = 0;
    }
    if (state->ahead && state->dense.end <= end) {
        state->time = state->dense.end;
        memcpy(state->states, state->dense.end_states, sizeof state->states);
        state->ahead = 0;
    }
    instance->cache.states_behind = false;
    if (!state->ahead && !(update_first_stage(instance) && step_adaptively(instance, end))) {
        return false;
    }
    instance->cache.states_behind = state->ahead != 0;
    return true;
}

/* Equal steps to the end, as many as make them no longer than solver_step. Times are computed from the start of the
   communication step, so that they do not drift. */
static bool integrate_in_equal_steps(Instance *instance, double end) {
    const State *state = &instance->state;
    const double start = state->time;
    const double setting = state->settings[SETTING_STEP];
    const double longest = smaller(setting > 0.0 ? setting : DEFAULT_SOLVER_STEP, longest_step(state));
    const double whole = (end - start) * (1.0 - 1e-9) - rounding_of_length(end); /* less: H = 10 h takes 10 steps */
    const double count = whole <= longest ? 1.0 : ceil(whole / longest);
    if (!(count <= MOST_STEPS)) {
        instance->failure.kind = FAILURE_STEP_COUNT;
        instance->failure.time = start;
        instance->failure.amount = count;
        return false;
    }
    if (!update_first_stage(instance)) {
        return false;
    }
    const double length = (end - start) / count;
    if (METHOD.variational) {
        watch_length(instance, length);
    }
    watch_vibrations(instance, length);
    for (double i = 1.0; i <= count; i++) {
        const double next = i < count ? start + (end - start) * (i / count) : end;
        const Step step = {length, next, false};
        instance->scratch.trial_length = length;
        if (!solver_step(instance, step) || leaps_over_singularity(instance, length) ||
            !bring_back_result(instance, step)) {
            return false;
        }
        watch_stiffness(instance, step);
        watch_ranges(instance, step);
        accept(instance, step);
    }
    return true;
}

bool integrate(Instance *instance, double end) {
    instance->failure.kind = FAILURE_NONE;
    instance->notice.kind = NOTICE_NONE;
    instance_forget_motion(instance);
    inputs_begin(instance);
    watch_motions(instance);
    const bool completed =
        METHOD.error_order > 0 ? integrate_adaptively(instance, end) : integrate_in_equal_steps(instance, end);
    if (completed) {
        instance->state.time = end;
        instance->state.undisturbed = 1;
    }
    inputs_end(instance);
    keep_motions(&instance->state);
    return completed;
}
