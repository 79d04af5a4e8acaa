/* Step size control. Sources:
   [HNW]  Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, 2nd edition, section II.4;
   [HW]   Hairer, Wanner, Solving Ordinary Differential Equations II, 2nd edition, section IV.2 (the PI controller),
          with the constants of the code dopri5.f of the same authors. */
#include "step_size.h"

#include <float.h>
#include <math.h>

#include "contacts.h"
#include "derivative.h"
#include "settings.h"
#include "step_control.h"

/* The proposed step over the way to the communication point: a step goes beyond the point only where it is greater. */
static const double WORTHWHILE = 1.25;

/* The exponent's denominator: the error estimate of a step h is proportional to h to this power. */
static double error_power(void) {
    return 1.0 + (double)(METHOD.error_order < METHOD.order ? METHOD.error_order : METHOD.order);
}

double longest_step(const State *state) {
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

/* [HNW], "Starting step size". */
double first_step(Instance *instance) {
    const State *state = &instance->state;
    Scratch *scratch = &instance->scratch;
    const double d0 = weighted_norm(state, state->states);
    const double d1 = weighted_norm(state, state->first_stage);
    const double h0 = d0 < RESTING || d1 < RESTING ? RESTING_PART * experiment_duration(state) : FIRST_PART * d0 / d1;

    for (int i = 0; i < N_STATES; i++) {
        scratch->stage_states[i] = state->states[i] + h0 * state->first_stage[i];
    }
    if (!derivative_at(instance, state->time + h0, scratch->stage_states, scratch->new_derivatives)) {
        return FAILED_START * h0;
    }
    for (int i = 0; i < N_STATES; i++) {
        scratch->new_derivatives[i] = (scratch->new_derivatives[i] - state->first_stage[i]) / h0;
    }
    const double largest = larger(d1, weighted_norm(state, scratch->new_derivatives));
    const double h1 = largest <= NO_CHANGE ? h0 : pow(FIRST_PART / largest, 1.0 / error_power());
    return smaller(FIRST_GROWTH * h0, h1);
}

/* The longest step (s) that follows friction in space: errors that grow in longer ones are seen only when they are as
   large as the tolerance, which is much for a slip that begins. It is more than rounding of the time, however slow a
   slip is that comes to rest. */
static double stable_step(Instance *instance) {
    const double decay = METHOD.stability > 0.0 ? contacts_decay(instance) : 0.0;
    const double shortest = SHORTEST_ROUNDINGS * DBL_EPSILON * fabs(instance->state.time);
    return decay > 0.0 ? larger(METHOD.safety * METHOD.stability / decay, shortest) : HUGE_VAL;
}

Step choose_step(Instance *instance, double end, double horizon, bool *cut_short) {
    const State *state = &instance->state;
    const double longest = smaller(longest_step(state), stable_step(instance));
    const double proposed = smaller(state->next_step, longest);
    const double near = end < horizon && end - state->time < proposed / WORTHWHILE ? horizon : end;
    const double remaining = near - state->time;
    if (remaining <= STRETCH * proposed && remaining <= MAX_STEP_SLACK * longest) {
        *cut_short = remaining < proposed;
        return (Step){remaining, near};
    }
    const double next = state->time + proposed;
    *cut_short = false;
    return (Step){next - state->time, next};
}

/* The PI controller of [HW]: h (1/error)^alpha previous_error^beta, bounded. */
void propose(State *state, Step step, bool cut_short, double error, bool after_rejection) {
    const double beta = REMEMBERED_EXPONENT / error_power();
    const double alpha = 1.0 / error_power() - REMEMBERED_SHARE * beta;
    double factor = METHOD.safety * exp(beta * state->previous_log_error - alpha * log(error)); /* error 0: infinite */
    factor = smaller(larger(factor, LARGEST_REDUCTION), after_rejection ? 1.0 : LARGEST_GROWTH);
    if (cut_short) {
        state->next_step = larger(state->next_step, factor * step.length);
    } else {
        state->next_step = factor * step.length;
        state->previous_log_error = log(larger(error, SMALLEST_ERROR));
    }
}

void propose_shorter(State *state, Step step, double error) {
    const bool measured = error > 1.0 && isfinite(error);
    const double factor = measured ? METHOD.safety * pow(error, -1.0 / error_power()) : UNMEASURED_REDUCTION;
    state->next_step = step.length * larger(factor, LARGEST_REDUCTION);
}
