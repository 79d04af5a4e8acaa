/* The explicit Runge-Kutta method TABLEAU. Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, 2nd
   edition, sections II.1 (the method), II.4 (the error estimate, formula 4.10, with the maximum norm), II.10 (the
   combined estimate, formula 10.17) and II.6 (dense output). */
#include <math.h>
#include <string.h>

#include "equations.h"
#include "runge_kutta.h"
#include "solver.h"

enum { MANY_STATES = 16 }; /* from here on a sum over the stages does not stay in registers */

static void add_stage(double weight, const double k[], double sum[]) {
    for (int i = 0; i < N_STATES; i++) {
        sum[i] += weight * k[i];
    }
}

/* Four stages at a time, so that the sum is loaded less often. */
static void add_by_fours(double scale, const double weights[], const int used[], int count,
                         const double stages[][N_STATES], double sum[]) {
    int j = 0;
    for (; j + 3 < count; j += 4) {
        const double *k0 = stages[used[j]], *k1 = stages[used[j + 1]], *k2 = stages[used[j + 2]];
        const double *k3 = stages[used[j + 3]];
        const double w0 = scale * weights[used[j]], w1 = scale * weights[used[j + 1]];
        const double w2 = scale * weights[used[j + 2]], w3 = scale * weights[used[j + 3]];
        for (int i = 0; i < N_STATES; i++) {
            sum[i] += (w0 * k0[i] + w1 * k1[i]) + (w2 * k2[i] + w3 * k3[i]);
        }
    }
    for (; j < count; j++) {
        add_stage(scale * weights[used[j]], stages[used[j]], sum);
    }
}

/* sum += scale sum_j weights[j] k_j over the first count stages. */
static void add_stages(const Instance *instance, double scale, const double weights[], int count, double sum[]) {
    const double(*stages)[N_STATES] = instance->scratch.stages;
    int used[STAGES];
    int size = 0;
    for (int j = 0; j < count; j++) {
        if (weights[j] != 0.0 && N_STATES < MANY_STATES) {
            add_stage(scale * weights[j], stages[j], sum);
        } else if (weights[j] != 0.0) {
            used[size++] = j;
        }
    }
    add_by_fours(scale, weights, used, size, stages, sum);
}

/* result = x + sum_j h weights[j] k_j over the first count stages; the last weight is not 0. The last stage was computed
   just now and is waited for: it takes part in one multiplication and two additions. */
static void combine(const Instance *instance, double h, const double weights[], int count, double result[]) {
    double sum[N_STATES] = {0.0};
    add_stages(instance, h, weights, count - 1, sum);
    const double weight = h * weights[count - 1];
    for (int i = 0; i < N_STATES; i++) {
        result[i] = instance->state.states[i] + (sum[i] + weight * instance->scratch.stages[count - 1][i]);
    }
}

/* Computes the stages from one up to the one before another; the states of the last one stay in scratch. */
static bool compute_stages(Instance *instance, Step step, int first, int end) {
    Scratch *scratch = &instance->scratch;
    for (int i = first; i < end; i++) {
        const double time = TABLEAU.c[i] == 1.0 ? step.end : instance->state.time + TABLEAU.c[i] * step.length;
        combine(instance, step.length, TABLEAU.a + i * TABLEAU.all_stages, i, scratch->stage_states);
        if (!equations_derivative(instance, time, scratch->stage_states, scratch->stages[i])) {
            return false;
        }
    }
    return true;
}

bool solver_step(Instance *instance, Step step) {
    const State *state = &instance->state;
    Scratch *scratch = &instance->scratch;
    const int last = TABLEAU.stages - 1;

    memcpy(scratch->stages[0], state->first_stage, sizeof state->first_stage);
    if (!compute_stages(instance, step, 1, TABLEAU.stages)) {
        return false;
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

double solver_error(const Instance *instance, Step step, double tolerance, int *worst) {
    const double *old = instance->state.states, *new = instance->scratch.new_states;
    double estimate[N_STATES] = {0.0}, other[N_STATES] = {0.0};
    double error = 0.0, second = 0.0;
    add_stages(instance, step.length, TABLEAU.e, TABLEAU.stages, estimate);
    if (TABLEAU.second != NULL) {
        add_stages(instance, 0.1 * step.length, TABLEAU.second, TABLEAU.stages, other);
    }
    *worst = 0;
    for (int i = 0; i < N_STATES; i++) {
        const double size = fabs(old[i]) > fabs(new[i]) ? fabs(old[i]) : fabs(new[i]);
        const double unit = 1.0 / (tolerance * (size + NOMINAL_STATES[i]));
        const double one = unit * fabs(estimate[i]), two = unit * fabs(other[i]);
        if (!(one <= error)) {
            error = one;
            *worst = i;
        }
        second = two > second ? two : second;
    }
    const double ratio = second / error;
    return second > 0.0 && error > 0.0 ? error / sqrt(1.0 + ratio * ratio) : error;
}

/* The last stage at the same time as the one before it, 0 if there is none: often both are at the end of the step. */
static int twin_stage(void) {
    int twin = TABLEAU.stages - 1;
    while (twin > 0 && TABLEAU.c[twin] != TABLEAU.c[twin - 1]) {
        twin--;
    }
    return twin;
}

/* Two stages are derivatives at the same time, at states that differ by an error of the method: where a fast decay is
   unstable, along its direction. Hairer, Wanner, Solving Ordinary Differential Equations II, 2nd edition,
   section IV.2, stiffness detection. Here the difference of the accelerations is held against those of velocities and
   coordinates, in nominal values: for a decay both give its rate, for a vibration the lesser one at most its frequency. */
double solver_stiffness(const Instance *instance) {
    const Scratch *scratch = &instance->scratch;
    const int twin = twin_stage();
    const double *weights = TABLEAU.a + twin * TABLEAU.all_stages, *before = weights - TABLEAU.all_stages;
    double apart[2] = {0.0}, rise = 0.0; /* squares; of coordinates and of velocities */
    if (twin == 0) {
        return 0.0;
    }
    for (int i = 0; i < N_STATES; i++) {
        double difference = 0.0;
        for (int j = 0; j < twin; j++) {
            difference += (weights[j] - before[j]) * scratch->stages[j][i];
        }
        difference /= NOMINAL_STATES[i];
        apart[i / N_COORDINATES] += difference * difference;
    }
    for (int i = N_COORDINATES; i < N_STATES; i++) {
        const double change = (scratch->stages[twin][i] - scratch->stages[twin - 1][i]) / NOMINAL_STATES[i];
        rise += change * change;
    }
    if (!(apart[0] > 0.0 && apart[1] > 0.0)) {
        return 0.0;
    }
    /* both rates times the length of the step, which the differences lack */
    return fmin(sqrt(rise / apart[1]), sqrt(scratch->trial_length * sqrt(rise / apart[0]))) / TABLEAU.stability;
}

bool solver_dense(Instance *instance, Step step, double terms[DENSE_TERMS][N_STATES]) {
    if (!compute_stages(instance, step, TABLEAU.stages, TABLEAU.all_stages)) {
        return false;
    }
    for (int row = 0; row < DENSE_ROWS; row++) {
        double *term = terms[HERMITE_TERMS + row];
        memset(term, 0, N_STATES * sizeof(double));
        add_stages(instance, step.length, TABLEAU.dense + row * TABLEAU.all_stages, TABLEAU.all_stages, term);
    }
    return true;
}
