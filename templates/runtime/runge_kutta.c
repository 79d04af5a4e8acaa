/* One step of the method TABLEAU. Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, 2nd edition,
   sections II.1 (the method), II.4 (the error estimate, formula 4.10, with the maximum norm). */
#include "runge_kutta.h"

#include <math.h>
#include <string.h>

#include "equations.h"
#include "finite.h"
#include "integrator.h"

/* result = x + sum_j h weights[j] k_j over the first count stages; the last weight is not 0. The last stage was computed
   just now and is waited for: it takes part in one multiplication and two additions. */
static void combine(const Instance *instance, double h, const double weights[], int count, double result[]) {
    double sum[N_STATES] = {0.0};
    for (int j = 0; j < count - 1; j++) {
        const double weight = h * weights[j];
        if (weight == 0.0) {
            continue;
        }
        for (int i = 0; i < N_STATES; i++) {
            sum[i] += weight * instance->scratch.stages[j][i];
        }
    }
    const double weight = h * weights[count - 1];
    for (int i = 0; i < N_STATES; i++) {
        result[i] = instance->state.states[i] + (sum[i] + weight * instance->scratch.stages[count - 1][i]);
    }
}

/* Are the new states finite? If not, sets instance->failure. */
static bool new_states_finite(Instance *instance, Step step) {
    if (all_finite(instance->scratch.new_states, N_STATES)) {
        return true;
    }
    for (int i = 0; i < N_STATES; i++) {
        if (!isfinite(instance->scratch.new_states[i])) {
            instance->failure.kind = FAILURE_OVERFLOW;
            instance->failure.time = instance->state.time;
            instance->failure.state = i;
            instance->failure.step = step.length;
            return false;
        }
    }
    return true;
}

bool runge_kutta_step(Instance *instance, Step step) {
    const State *state = &instance->state;
    Scratch *scratch = &instance->scratch;
    const int last = TABLEAU.stages - 1;

    memcpy(scratch->stages[0], state->first_stage, sizeof state->first_stage);
    for (int i = 1; i <= last; i++) {
        const double time = TABLEAU.c[i] == 1.0 ? step.end : state->time + TABLEAU.c[i] * step.length;
        combine(instance, step.length, TABLEAU.a + i * TABLEAU.stages, i, scratch->stage_states);
        if (!equations_derivative(instance, time, scratch->stage_states, scratch->stages[i])) {
            return false;
        }
    }
    if (TABLEAU.first_same_as_last) {
        memcpy(scratch->new_states, scratch->stage_states, sizeof scratch->new_states);
        memcpy(scratch->new_derivatives, scratch->stages[last], sizeof scratch->new_derivatives);
        return new_states_finite(instance, step);
    }
    combine(instance, step.length, TABLEAU.b, TABLEAU.stages, scratch->new_states);
    return new_states_finite(instance, step) &&
           equations_derivative(instance, step.end, scratch->new_states, scratch->new_derivatives);
}

double runge_kutta_error(const Instance *instance, Step step, double tolerance, int *worst) {
    const Scratch *scratch = &instance->scratch;
    double largest = 0.0;
    *worst = 0;
    for (int i = 0; i < N_STATES; i++) {
        double error = 0.0;
        for (int j = 0; j < TABLEAU.stages; j++) {
            error += TABLEAU.e[j] * scratch->stages[j][i];
        }
        const double size = fmax(fabs(instance->state.states[i]), fabs(scratch->new_states[i]));
        error = fabs(step.length * error) / (tolerance * (size + NOMINAL_STATES[i]));
        if (!(error <= largest)) {
            largest = error;
            *worst = i;
        }
    }
    return largest;
}
