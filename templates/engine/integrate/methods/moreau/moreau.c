/* Moreau-Jean time stepping: impacts, contacts and friction obey their laws as impulses over each step, and no event is
   located. q moves on with the mean of the velocities at both ends, forces are those in the middle of the step: without
   contacts this is the leapfrog method. Linear dampers pull with the mean velocity, so that no step is too long for
   them. The error is of first order, the cost of a step bounded whatever happens in it.
   Moreau, Numerical aspects of the sweeping process, Comput. Methods Appl. Mech. Eng. 177, 1999. */
#include <math.h>
#include <string.h>

#include "contact_events.h"
#include "fixed_steps.h"
#include "inputs.h"
#include "scale.h"
#include "step_failure.h"
#include "step_impulses.h"
#include "step_modes.h"
#include "step_positions.h"
#include "step_velocities.h"
#include "tables.h"

const Method METHOD = {.name = "moreau", .order = 1};

/* The velocities after the impulses. */
static void find_step_velocities(Instance *instance, double length, double qd[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, changes, N);
    const double *before = instance->state.states + N;
    const SolverScratch *scratch = &instance->scratch.solver;
    stepped_respond(instance, scratch->impulses, changes);
    for (int i = 0; i < N; i++) {
        const double pushed = length * scratch->accelerations[i];
        const double least = SOLVED * scratch->pace * NOMINAL_STATES[i];
        const double terms = MET * (fabs(before[i]) + fabs(pushed)), dust = terms > least ? terms : least;
        qd[i] = before[i] + (pushed + changes[i]);
        qd[i] = fabs(qd[i]) <= dust ? 0.0 : qd[i];
    }
    arena_release(mark);
}

/* The terms that make a singular M regular bear a part of the permanent constraints' impulses. Adds this part. */
static void complete_impulses(Instance *instance, const double qd[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, changes, N);
    SolverScratch *scratch = &instance->scratch.solver;
    const System *system = &instance->scratch.system;
    for (int i = 0; i < N; i++) {
        changes[i] = qd[i] - instance->state.states[N + i];
    }
    for (int row = 0; row < N_PERMANENT; row++) {
        scratch->impulses[row] -= system->weight[PLACES[row]] * stepped_along(&scratch->at, row, changes);
    }
    arena_release(mark);
}

/* middle[2n] gets the mean of the velocities at both ends, and switches turn as it says. */
static void take_mean(Instance *instance, double time, const double qd[], double middle[]) {
    for (int i = 0; i < N; i++) {
        middle[N + i] = 0.5 * (instance->state.states[N + i] + qd[i]);
    }
    step_turn_switches(instance, time, middle);
}

/* Moves z with its rate at the middle of the step, and adds the energy that normal impulses take to the dissipated
   energy, whose rate holds dampers and friction alone. */
static bool find_further(Instance *instance, double time, double length, const double middle[], double states[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, unknowns, N_UNKNOWNS);
    WORK(mark, double, rates, SIZE_FURTHER);
    const SolverScratch *scratch = &instance->scratch.solver;
    unknowns_of(scratch->impulses, length, unknowns);
    for (int i = 0; i < N; i++) {
        unknowns[i] = (states[N + i] - instance->state.states[N + i]) / length;
    }
    if (!contacts_oppose(instance, time, middle, unknowns) ||
        !stepped_further(instance, time, middle, unknowns, rates)) {
        return arena_leave(mark, false);
    }
    for (int i = 2 * N; i < N_STATES; i++) {
        states[i] = middle[i] + length * rates[i - 2 * N];
    }
    for (int c = 0; c < N_UNILATERALS; c++) {
        const int row = CONTACT_ROWS[c];
        states[DISSIPATED] -= 0.5 * scratch->impulses[row] * (scratch->at.velocities[row] + scratch->after[row]);
    }
    return arena_leave(mark, true);
}

/* The positions at the end, and velocities that go with them. The work that the correction of q takes from the forces
   is no loss of energy. */
static bool find_positions(Instance *instance, Step step, const double middle[], double states[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, before, N);
    const double *forcing = instance->scratch.system.forcing;
    for (int i = 0; i < N; i++) {
        states[i] = instance->state.states[i] + step.length * middle[N + i];
    }
    memcpy(before, states, N * sizeof(double));
    if (!new_states_finite(instance, step) || !step_positions(instance, step, states)) {
        return arena_leave(mark, false);
    }
    for (int i = 0; i < N; i++) {
        states[DISSIPATED] += forcing[i] * (states[i] - before[i]);
    }
    step_velocities(instance, states);
    return arena_leave(mark, new_states_finite(instance, step));
}

/* Does a contact collide in this step? */
static bool collides(const Instance *instance) {
    bool found = false;
    for (int c = 0; c < N_UNILATERALS; c++) {
        found = found || step_collides(instance, c);
    }
    return found;
}

/* The velocities qd[n] at the end; in middle[2n] the mean of both ends takes the place of those at the beginning.
   Forces and coefficients that depend on velocities belong to that mean, too; at impacts coefficients are those before
   the jump. Forces of linear dampers belong to the mean at once. */
static bool solve_step_velocities(Instance *instance, double time, double length, double middle[], double qd[]) {
    SolverScratch *rows = &instance->scratch.solver;
    if (!step_middle(instance, time, 0.5 * length, middle)) {
        tables_explain(instance, time, middle, inputs_at(instance, time));
        return false;
    }
    stepped_accelerate(instance, rows->accelerations);
    if (!step_begin(instance, time, middle, length)) {
        return false;
    }
    const bool moving = VELOCITY_FORCES != 0 || VELOCITY_FRICTION != 0 ||
                        (IMPLICIT_DAMPERS != 0 && instance->scratch.system.dense);
    for (int pass = 0; pass <= (moving ? 1 : 0); pass++) {
        if (pass > 0) {
            stepped_force(instance, time, middle);
            stepped_accelerate(instance, rows->accelerations);
            if (VELOCITY_FRICTION && !collides(instance) && !step_coefficients(instance, time, middle)) {
                return false;
            }
        }
        if (!step_impulses(instance, time, middle, length)) {
            return false;
        }
        find_step_velocities(instance, length, qd);
        take_mean(instance, time, qd, middle);
    }
    complete_impulses(instance, qd);
    return true;
}

/* Finds scratch.new_states. */
static bool find_states(Instance *instance, Step step) {
    const State *state = &instance->state;
    double *middle = instance->scratch.stage_states, *states = instance->scratch.new_states;
    const double half = 0.5 * step.length, time = state->time + half;
    memcpy(middle, state->states, sizeof instance->scratch.stage_states);
    for (int i = 0; i < N; i++) {
        middle[i] += half * middle[N + i];
    }
    step_turn_switches(instance, time, middle);
    return solve_step_velocities(instance, time, step.length, middle, states + N) &&
           find_further(instance, time, step.length, middle, states) && find_positions(instance, step, middle, states);
}

bool solver_step(Instance *instance, Step step) {
    State *state = &instance->state;
    Scratch *scratch = &instance->scratch;
    if (!find_states(instance, step)) {
        return false;
    }
    for (int row = 0; row < K; row++) {
        state->solver.forces[row] = scratch->solver.impulses[row] / step.length;
    }
    for (int i = 0; i < N_STATES; i++) {
        scratch->new_derivatives[i] = (scratch->new_states[i] - state->states[i]) / step.length;
    }
    step_modes(instance, step.end, scratch->new_states);
    return true;
}

double solver_stiffness(const Instance *instance) {
    (void)instance;
    return 0.0;
}
