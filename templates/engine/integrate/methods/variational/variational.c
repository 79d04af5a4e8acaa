/* Variational integrators: the principle of least action, discretised. The action over a step is a quadrature (b, c) of
   L along a polynomial of the coordinates; making it stationary gives for the velocities V_i at the stages

       dL/dqd (Q_i, V_i) = p + h sum_j hat_ij F_j,   Q_i = q + h sum_j a_ij V_j,   F = dL/dq - dR/dqd + Q,

   and q, p move on by h sum_j b_j V_j and h sum_j b_j F_j. With Gauss points these are the Gauss methods in q and p
   (a = hat), with Lobatto points the pairs IIIA and IIIB, of which the first is Stoermer and Verlet's. They keep the
   symplectic form, momenta of symmetries, and energy up to a bounded error. Forces enter as in the discrete principle
   of d'Alembert. Sources: Marsden, West, Discrete mechanics and variational integrators, Acta Numerica 2001, sections
   2.6 and 3.2; Hairer, Lubich, Wanner, Geometric Numerical Integration, 2nd edition, section VI.6.

   Holonomic constraints phi = 0 hold at nodes within the step, from its start to its end, and add the forces G^T
   multiplier at these nodes, G = dphi/dq: h sum_j hat_ij G_j^T multiplier_j to the momenta at stage i. Nodes are the
   stages of the Lobatto pairs, and of s Gauss points the s + 1 points of Lobatto. The first one is the start, which is
   on the constraints; the multiplier at the last one acts on no stage, and serves to end with G qd + dphi/dt = 0. With
   Lobatto's two stages that is RATTLE. Sources: Jay, Symplectic partitioned Runge-Kutta methods for constrained
   Hamiltonian systems, SIAM Journal on Numerical Analysis 33, 1996; Jay, Specialized partitioned additive Runge-Kutta
   methods for systems of overdetermined DAEs with holonomic constraints, the same 45, 2007; Hairer, Lubich, Wanner,
   sections VII.1.3 and VII.1.4; Marsden, West, section 3.5. Momenta determine velocities where M is regular: if it
   never is, L holds an energy of the constraints' velocities, which is 0 along the motion.

   Nonholonomic constraints G qd + b = 0 have such forces, too, by the principle of Lagrange and d'Alembert. Their
   integrals up to the nodes vanish, by the weights that give the coordinates there. So they are met as holonomic ones
   where G is constant. Jay, Lagrange-d'Alembert SPARK integrators for nonholonomic Lagrangian systems, 2009.

   What slides is a force as all others: a function of the state at the stage, with the normal forces that the equations
   of motion have there.

   Further states z are collocated at the same points, Z_i = z + h sum_j a_ij dz/dt_j, so that q and z together make one
   part of a partitioned method and p the other: the order is that of the method, Hairer, Lubich, Wanner, theorem
   II.2.2.

   The equations are solved to rounding and the sums are compensated, so that rounding errors do not add up to a drift:
   Hairer, McLachlan, Razakarivony, Achieving Brouwer's law with implicit Runge-Kutta methods, BIT 48, 2008. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "contacts.h"
#include "derivative.h"
#include "finite.h"
#include "fixed_steps.h"
#include "inputs.h"
#include "scale.h"
#include "step_failure.h"
#include "system.h"
#include "variational.h"

/* Bound of the iterations for the velocities at the stages; the step fails beyond it. */
enum { MOST_MOMENTUM_ITERATIONS = 100 };

static void canonical_at(Instance *instance, double time, const double states[], double momenta[], double forces[]) {
    mechanism_canonical(time, states, inputs_at(instance, time), instance->state.parameters, momenta, forces);
}

/* sum_j weights[j] rows[j][i] */
static double weighed(const double weights[], double rows[][N], int i) {
    double sum = 0.0;
    for (int j = 0; j < S; j++) {
        sum += weights[j] * rows[j][i];
    }
    return sum;
}

static bool factorize_mass(Instance *instance, double time, const double states[]) {
    System *system = &instance->scratch.system;
    return system_factorize(instance, time, states, inputs_at(instance, time), N_CONSTRAINTS, 0.0, system) &&
           mass_regular(instance, time, states, system);
}

/* Further states at stage i or, for i = S, at the end of the step, of the derivatives that are known at the stages. */
static double further_at(const Instance *instance, double h, const Stages *stages, int i, int k) {
    const double *weights = i < S ? COLLOCATION.a + i * S : COLLOCATION.b;
    double sum = 0.0;
    for (int j = 0; j < S; j++) {
        sum += weights[j] * stages->rates[j][k];
    }
    return instance->state.states[2 * N + k] + h * sum;
}

/* Their derivatives at the stages; the system that is factorised in scratch stays. */
static bool rate_further(Instance *instance, Step step, Stages *stages) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_OF(mark, System, kept);
    WORK(mark, double, states, N_STATES);
    WORK(mark, double, derivatives, N_STATES);
    System *system = &instance->scratch.system;
    *kept = *system;
    bool known = true;
    for (int i = 0; i < S && known; i++) {
        stage_states(stages, i, states);
        known = derivative_at(instance, time_within(instance, step, COLLOCATION.c[i]), states, derivatives);
        memcpy(stages->rates[i], derivatives + 2 * N, N_FURTHER * sizeof(double));
    }
    *system = *kept;
    return arena_leave(mark, known);
}

/* Further states at the stages, moved on by one round. Returns the greatest relative change, infinite where they have
   no derivative. */
static double correct_further(Instance *instance, Step step, Stages *stages) {
    double greatest = 0.0;
    if (N_FURTHER > 0 && !rate_further(instance, step, stages)) {
        return HUGE_VAL;
    }
    for (int i = 0; i < S; i++) {
        for (int k = 0; k < N_FURTHER; k++) {
            const double z = further_at(instance, step.length, stages, i, k);
            const double relative = fabs(z - stages->further[i][k]) / (fabs(z) + NOMINAL_STATES[2 * N + k]);
            greatest = isfinite(relative) ? fmax(greatest, relative) : HUGE_VAL;
            stages->further[i][k] = z;
        }
    }
    return greatest;
}

/* Adds what slides to the forces at the stages; the system that is factorised in scratch stays. */
static bool add_friction(Instance *instance, Step step, Stages *stages) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_OF(mark, System, kept);
    WORK(mark, double, states, N_STATES);
    System *system = &instance->scratch.system;
    *kept = *system;
    bool known = true;
    for (int i = 0; i < S && known; i++) {
        stage_states(stages, i, states);
        known = contacts_rub(instance, time_within(instance, step, COLLOCATION.c[i]), states, stages->forces[i]);
    }
    *system = *kept;
    return arena_leave(mark, known);
}

/* Coordinates, momenta and forces that belong to the velocities. */
static bool finish_step(Instance *instance, Step step, Stages *stages) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, states, N_STATES);
    for (int i = 0; i < S; i++) {
        for (int k = 0; k < N; k++) {
            stages->coordinates[i][k] =
                instance->state.states[k] + step.length * weighed(COLLOCATION.a + i * S, stages->velocities, k);
        }
        stage_states(stages, i, states);
        canonical_at(instance, time_within(instance, step, COLLOCATION.c[i]), states, stages->momenta[i],
                 stages->forces[i]);
    }
    stages_constrain(instance, step, stages);
    return arena_leave(mark, !contacts_sliding(instance) || add_friction(instance, step, stages));
}

/* One round of the iteration: each V_i is corrected by M^-1 times what is missing from its momentum, with M at the
   start of the step. Returns the greatest relative change. Constraints determine velocities up to the rounding of
   coordinates divided by h, which in very short steps is more than the rounding of velocities. */
static double correct_velocities(Instance *instance, Step step, const double p[], Stages *stages) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_ROWS(mark, double, changes, S, N_UNKNOWNS);
    WORK(mark, double, missing, N_COORDINATES);
    static const double NO_REST[SIZE_CONSTRAINTS] = {0.0};
    double greatest = 0.0;
    for (int i = 0; i < S; i++) {
        for (int k = 0; k < N; k++) {
            const double force = weighed(COLLOCATION.hat + i * S, stages->forces, k) + stages_reaction(stages, i, k);
            missing[k] = p[k] + step.length * force - stages->momenta[i][k];
        }
        system_solve(&instance->scratch.system, missing, NO_REST, NULL, changes[i]);
    }
    stages_meet_constraints(&instance->scratch.system, step.length, stages, changes);
    for (int i = 0; i < S; i++) {
        for (int k = 0; k < N; k++) {
            stages->velocities[i][k] += changes[i][k];
            const double reach = (fabs(stages->coordinates[i][k]) + NOMINAL_STATES[k]) / step.length;
            const double rounding = 16.0 * DBL_EPSILON / OBEYED * reach; /* as a change of OBEYED of it */
            const double size = fabs(stages->velocities[i][k]) + NOMINAL_STATES[N + k] + rounding;
            const double relative = fabs(changes[i][k]) / size;
            greatest = isfinite(relative) ? fmax(greatest, relative) : HUGE_VAL;
        }
    }
    arena_release(mark);
    return greatest;
}

/* Iterates until the changes are rounding errors: until they do not fall any more. */
static bool solve_stages(Instance *instance, Step step, const double p[], Stages *stages) {
    double previous = HUGE_VAL;
    for (int i = 0; i < MOST_MOMENTUM_ITERATIONS; i++) {
        if (!finish_step(instance, step, stages)) {
            return false;
        }
        const double further = correct_further(instance, step, stages);
        const double change = fmax(further, correct_velocities(instance, step, p, stages));
        /* changes far below rounding may fall on slowly, and make no difference */
        if (change <= SLIVER * DBL_EPSILON || (change <= OBEYED && change >= previous)) {
            return finish_step(instance, step, stages);
        }
        if (!(change < 1e3 * previous) || change == HUGE_VAL) {
            break;
        }
        previous = change;
    }
    return report_iteration(instance, step);
}

/* Returns x + increment. The error that earlier sums left in rest goes in, and that of this sum comes out. */
static double add_compensated(double x, double increment, double *rest) {
    const double whole = increment + *rest;
    const double sum = x + whole;
    *rest = (x - sum) + whole;
    return sum;
}

/* Makes the velocities in states, at a time (s), those whose momenta are next->momenta, M qd + a = p, corrected once
   for rounding. Under constraints p lacks the impulse of the last multiplier until it makes the velocities meet
   them. */
static bool momenta_velocities(Instance *instance, double time, SolverMemory *next, double states[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, resting, N_STATES);
    WORK_ZEROS(mark, double, impulse, N);
    WORK(mark, double, momenta, N);
    WORK(mark, double, forces, N);
    memcpy(resting, states, N_STATES * sizeof(double));
    memset(resting + N, 0, N * sizeof(double));
    if (!factorize_mass(instance, time, resting)) {
        return arena_leave(mark, false);
    }
    memcpy(states, resting, N_STATES * sizeof(double));
    for (int round = 0; round < 2; round++) {
        canonical_at(instance, time, states, momenta, forces);
        for (int k = 0; k < N; k++) {
            momenta[k] = next->momenta[k] + impulse[k] - momenta[k];
        }
        stages_end_step(instance, time, momenta, states, impulse);
    }
    for (int k = 0; k < N; k++) {
        next->momenta[k] = add_compensated(next->momenta[k], impulse[k], &next->rest_momenta[k]);
    }
    return arena_leave(mark, true);
}

/* The momenta at the present point: kept from the last step, or new if something was changed since. Where motions were
   changed, alone or with other inputs, the momenta are kept and the velocities are new: a support that changes its
   velocity by a jump strikes. Inputs that are no motions move no velocity; momenta that contain one are new. */
static bool update_momenta(Instance *instance) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, forces, N);
    State *state = &instance->state;
    if (!state->solver.valid || (state->solver.driven && !state->solver.moved)) {
        memset(&state->solver, 0, sizeof state->solver);
        canonical_at(instance, state->time, state->states, state->solver.momenta, forces);
        state->solver.valid = 1;
    } else if (state->solver.moved && !momenta_velocities(instance, state->time, &state->solver, state->states)) {
        return arena_leave(mark, false);
    }
    state->solver.driven = state->solver.moved = 0;
    return arena_leave(mark, true);
}

/* The stages to begin with: as if the accelerations and the further states at the start were constant. */
static void guess_stages(const Instance *instance, Step step, Stages *stages) {
    const State *state = &instance->state;
    for (int i = 0; i < S; i++) {
        double share = 0.0;
        for (int j = 0; j < S; j++) {
            share += COLLOCATION.hat[i * S + j];
        }
        for (int k = 0; k < N; k++) {
            stages->velocities[i][k] = state->states[N + k] + share * step.length * state->first_stage[N + k];
        }
        memcpy(stages->further[i], state->states + 2 * N, N_FURTHER * sizeof(double));
        memset(stages->rates[i], 0, N_FURTHER * sizeof(double));
    }
    stages_guess_multipliers(&instance->scratch.system, stages);
}

/* A step of this method is never rejected: momenta and rests of sums go to the State at once. */
bool solver_step(Instance *instance, Step step) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_OF(mark, SolverMemory, next);
    State *state = &instance->state;
    Scratch *scratch = &instance->scratch;
    Stages *stages = &scratch->solver;

    if (!update_momenta(instance)) {
        return arena_leave(mark, false);
    }
    *next = state->solver;
    if (!factorize_mass(instance, state->time, state->states)) {
        return arena_leave(mark, false);
    }
    guess_stages(instance, step, stages);
    if (!solve_stages(instance, step, state->solver.momenta, stages)) {
        return arena_leave(mark, false);
    }
    for (int k = 0; k < N; k++) {
        const double shift = step.length * weighed(COLLOCATION.b, stages->velocities, k);
        const double kick =
            step.length * (weighed(COLLOCATION.b, stages->forces, k) + stages_reaction(stages, S, k));
        scratch->new_states[k] = add_compensated(state->states[k], shift, &next->rest_coordinates[k]);
        next->momenta[k] = add_compensated(state->solver.momenta[k], kick, &next->rest_momenta[k]);
    }
    for (int k = 0; k < N_FURTHER; k++) {
        scratch->new_states[2 * N + k] = further_at(instance, step.length, stages, S, k);
    }
    if (!momenta_velocities(instance, step.end, next, scratch->new_states) ||
        !derivative_at(instance, step.end, scratch->new_states, scratch->new_derivatives)) {
        return arena_leave(mark, false);
    }
    if (!all_finite(scratch->new_states, N_STATES) || !new_states_on_constraints(instance, step)) {
        return arena_leave(mark, report_iteration(instance, step));
    }
    state->solver = *next;
    return arena_leave(mark, true);
}

double solver_stiffness(const Instance *instance) {
    (void)instance;
    return 0.0; /* steps have a fixed length */
}
