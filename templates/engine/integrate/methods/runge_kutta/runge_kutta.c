/* The explicit Runge-Kutta method TABLEAU. Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, 2nd
   edition, sections II.1 (the method), II.4 (the error estimate, formula 4.10, with the maximum norm), II.10 (the
   combined estimate, formula 10.17) and II.6 (dense output). */
#include <math.h>
#include <string.h>

#include "derivative.h"
#include "solver.h"
#include "step_failure.h"
#include "tableau.h"

/* In real time the next step evaluates what it begins with, with the inputs that it then has: a step takes as long with
   new inputs as without. Until then the last stage tells the derivatives as well as is needed. */
enum { LATE_DERIVATIVES = REAL_TIME && N_CONSTRAINTS == 0 };

static Stages stages_of(const Instance *instance) {
    return instance->scratch.solver.stages;
}

/* Computes the stages from one up to the one before another; the states of the last one stay in scratch. */
static bool compute_stages(Instance *instance, Step step, int first, int end) {
    Scratch *scratch = &instance->scratch;
    for (int i = first; i < end; i++) {
        const double time = TABLEAU.c[i] == 1.0 ? step.end : instance->state.time + TABLEAU.c[i] * step.length;
        tableau_states(i, step.length, instance->state.states, stages_of(instance), scratch->stage_states);
        if (!derivative_at(instance, time, scratch->stage_states, scratch->solver.stages[i])) {
            return false;
        }
    }
    return true;
}

bool solver_step(Instance *instance, Step step) {
    const State *state = &instance->state;
    Scratch *scratch = &instance->scratch;
    const int last = TABLEAU.stages - 1;

    memcpy(scratch->solver.stages[0], state->first_stage, sizeof state->first_stage);
    if (!compute_stages(instance, step, 1, TABLEAU.stages)) {
        return false;
    }
    if (TABLEAU.first_same_as_last) {
        memcpy(scratch->new_states, scratch->stage_states, sizeof scratch->new_states);
        memcpy(scratch->new_derivatives, scratch->solver.stages[last], sizeof scratch->new_derivatives);
        return new_states_finite(instance, step);
    }
    tableau_states(STAGES, step.length, state->states, stages_of(instance), scratch->new_states);
    if (LATE_DERIVATIVES) {
        memcpy(scratch->new_derivatives, scratch->solver.stages[last], sizeof scratch->new_derivatives);
        scratch->derivatives_late = true;
        return new_states_finite(instance, step);
    }
    return new_states_finite(instance, step) &&
           derivative_at(instance, step.end, scratch->new_states, scratch->new_derivatives);
}

double solver_error(const Instance *instance, Step step, double tolerance, int *worst) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, estimate, N_STATES);
    WORK(mark, double, other, N_STATES);
    const double *old = instance->state.states, *next = instance->scratch.new_states;
    double error = 0.0, second = 0.0;
    tableau_errors(step.length, stages_of(instance), estimate, other);
    *worst = 0;
    for (int i = 0; i < N_MOVING; i++) {
        const double size = fabs(old[i]) > fabs(next[i]) ? fabs(old[i]) : fabs(next[i]);
        const double unit = 1.0 / (tolerance * (size + NOMINAL_STATES[i]));
        const double one = unit * fabs(estimate[i]), two = unit * fabs(other[i]);
        if (!(one <= error)) {
            error = one;
            *worst = i;
        }
        second = two > second ? two : second;
    }
    const double ratio = 0.1 * second / error;
    arena_release(mark);
    return second > 0.0 && error > 0.0 ? error / sqrt(1.0 + ratio * ratio) : error;
}

/* Two stages are derivatives at the same time, at states that differ by an error of the method: where a fast decay is
   unstable, along its direction. Hairer, Wanner, Solving Ordinary Differential Equations II, 2nd edition, section IV.2,
   stiffness detection. Here the difference of the accelerations is divided by those of velocities and of coordinates,
   in nominal values; further states count with the velocities. For a decay both quotients give its rate, for a
   vibration the lesser one is at most its frequency. */
double solver_stiffness(const Instance *instance) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, difference, N_STATES); /* squares; of coordinates and of velocities */
    const Scratch *scratch = &instance->scratch;
    double apart[2] = {0.0}, rise = 0.0;
    if (TABLEAU.twin == 0) {
        arena_release(mark);
        return 0.0;
    }
    tableau_difference(stages_of(instance), difference);
    for (int i = 0; i < N_STATES; i++) {
        const double distance = difference[i] / NOMINAL_STATES[i];
        apart[i < N_COORDINATES ? 0 : 1] += distance * distance;
    }
    const double *at = scratch->solver.stages[TABLEAU.twin], *before = scratch->solver.stages[TABLEAU.twin - 1];
    for (int i = N_COORDINATES; i < N_STATES; i++) {
        const double change = (at[i] - before[i]) / NOMINAL_STATES[i];
        rise += change * change;
    }
    if (!(apart[0] > 0.0 && apart[1] > 0.0)) {
        arena_release(mark);
        return 0.0;
    }
    /* both rates times the length of the step, which the differences lack */
    arena_release(mark);
    return fmin(sqrt(rise / apart[1]), sqrt(scratch->trial_length * sqrt(rise / apart[0]))) / METHOD.stability;
}

bool solver_dense(Instance *instance, Step step, double terms[DENSE_TERMS][N_STATES]) {
    if (!compute_stages(instance, step, TABLEAU.stages, STAGES)) {
        return false;
    }
    tableau_dense(step.length, stages_of(instance), terms);
    return true;
}
