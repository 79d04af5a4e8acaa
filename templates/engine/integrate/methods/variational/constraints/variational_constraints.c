/* The constraints' part of variational integrators, see variational.c.

   A step meets the constraints at its end by forces along G at its stages, the first of which is its begin. Where
   constraints become dependent, as those of a linkage in its fold, no force along G there has the missing direction:
   the discrete equations have no solution, and a step that begins there is discarded. Solvers that project go on. */
#include <math.h>

#include "constraint_factorization.h"
#include "constraints.h"
#include "failure.h"
#include "inputs.h"
#include "scale.h"
#include "system.h"
#include "variational.h"

static const double NO_FORCE[N_COORDINATES] = {0.0}; /* zeros */

void stages_guess_multipliers(const System *system, Stages *stages) {
    const ArenaMark mark = arena_mark(system->arena);
    WORK(mark, double, below, K);
    WORK(mark, double, unknowns, N_UNKNOWNS);
    for (int k = 0; k < K; k++) {
        below[k] = -system->gamma[k];
    }
    system_solve(system, system->forcing, below, NULL, unknowns);
    for (int i = 0; i < NODES.count - 1; i++) {
        memcpy(stages->multipliers[i], unknowns + N, K * sizeof(double));
    }
    arena_release(mark);
}

/* Coordinates and further states at node i; velocities are 0, because no force there contains them. */
static void node_states(const Instance *instance, double h, const Stages *stages, int i, double states[]) {
    memcpy(states, instance->state.states, N_STATES * sizeof(double));
    memset(states + N, 0, N * sizeof(double));
    for (int j = 0; j < S; j++) {
        const double weight = h * NODES.a[i * S + j];
        for (int k = 0; k < N; k++) {
            states[k] += weight * stages->velocities[j][k];
        }
        for (int k = 0; k < N_FURTHER; k++) {
            states[2 * N + k] += weight * stages->rates[j][k];
        }
    }
}

/* Residuals of the holonomic constraints at node i, and the forces of all there. */
static void constrain_node(Instance *instance, Step step, Stages *stages, int i) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, states, N_STATES);
    WORK(mark, double, velocities, K);
    WORK(mark, double, jacobian, K * N);
    const double time = time_within(instance, step, NODES.c[i]);
    node_states(instance, step.length, stages, i, states);
    mechanism_constraints(time, states, inputs_at(instance, time), instance->state.parameters, stages->residuals[i],
                          velocities, jacobian);
    for (int j = 0; j < N; j++) {
        stages->reactions[i][j] = 0.0;
        for (int k = 0; k < K; k++) {
            stages->reactions[i][j] += jacobian[k * N + j] * stages->multipliers[i][k];
        }
    }
    arena_release(mark);
}

/* Residuals of the nonholonomic constraints G qd + b = 0: its integrals from the start to the nodes. */
static void integrate_velocities(Instance *instance, Step step, Stages *stages) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_ROWS(mark, double, speeds, S, K);
    WORK(mark, double, states, N_STATES);
    WORK(mark, double, positions, N_HOLONOMIC + 1);
    WORK(mark, double, jacobian, K * N);
    for (int j = 0; j < S; j++) {
        const double time = time_within(instance, step, COLLOCATION.c[j]);
        stage_states(stages, j, states);
        mechanism_constraints(time, states, inputs_at(instance, time), instance->state.parameters, positions, speeds[j],
                              jacobian);
    }
    for (int i = 0; i < NODES.count; i++) {
        for (int k = N_HOLONOMIC; k < K; k++) {
            double sum = 0.0;
            for (int j = 0; j < S; j++) {
                sum += NODES.a[i * S + j] * speeds[j][k];
            }
            stages->residuals[i][k] = step.length * sum;
        }
    }
    arena_release(mark);
}

void stages_constrain(Instance *instance, Step step, Stages *stages) {
    memset(stages->multipliers[NODES.count - 1], 0, sizeof stages->multipliers[0]);
    for (int i = 0; i < NODES.count; i++) {
        constrain_node(instance, step, stages, i);
    }
    if (K > N_HOLONOMIC) {
        integrate_velocities(instance, step, stages);
    }
}

double stages_reaction(const Stages *stages, int i, int coordinate) {
    const double *weights = i < S ? NODES.hat + i * NODES.count : NODES.b;
    double sum = 0.0;
    for (int j = 0; j < NODES.count - 1; j++) {
        sum += weights[j] * stages->reactions[j][coordinate];
    }
    return sum;
}

/* The corrections d_j of the multipliers, see stages_meet_constraints. */
static void correct_multipliers(const System *system, double h, double changes[S][N_UNKNOWNS],
                                double residuals[SIZE_NODES][K], double d[SIZE_NODES][K]) {
    const ArenaMark mark = arena_mark(system->arena);
    WORK(mark, double, answer, N_UNKNOWNS);
    const int last = NODES.count - 1;
    memset(d, 0, SIZE_NODES * sizeof d[0]);
    for (int i = 1; i <= last; i++) {
        system_solve(system, NO_FORCE, residuals[i], NULL, answer);
        for (int k = 0; k < K; k++) {
            double right = -answer[N + k];
            for (int j = 0; j < S; j++) {
                right += h * NODES.a[i * S + j] * changes[j][N + k];
            }
            for (int j = 0; j < last; j++) {
                d[j][k] += NODES.weights[j * last + i - 1] * right / (h * h);
            }
        }
    }
    arena_release(mark);
}

/* changes[i] = [x_i, mu_i] solve M x_i = missing_i + G^T mu_i, G x_i = 0. With A = G M^-1 G^T the multipliers change by
   d_j, of which

       h^2 sum_jk a_ij hat_jk A d_k = h sum_j a_ij A mu_j - phi_i

   with a and hat of the nodes. The velocities change by x_i + M^-1 G^T (h sum_j hat_ij d_j - mu_i). */
void stages_meet_constraints(const System *system, double h, Stages *stages, double changes[S][N_UNKNOWNS]) {
    const ArenaMark mark = arena_mark(system->arena);
    WORK_ROWS(mark, double, d, SIZE_NODES, K);
    WORK(mark, double, impulse, K);
    correct_multipliers(system, h, changes, stages->residuals, d);
    for (int i = 0; i < S; i++) {
        for (int k = 0; k < K; k++) {
            impulse[k] = -changes[i][N + k];
            for (int j = 0; j < NODES.count - 1; j++) {
                impulse[k] += h * NODES.hat[i * NODES.count + j] * d[j][k];
            }
        }
        constraints_respond(&system->constraints, impulse, changes[i]);
    }
    for (int i = 0; i < NODES.count - 1; i++) {
        for (int k = 0; k < K; k++) {
            stages->multipliers[i][k] += d[i][k];
        }
    }
    arena_release(mark);
}

void stages_end_step(Instance *instance, double time, const double missing[], double states[], double impulse[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, positions, K);
    WORK(mark, double, velocities, K);
    WORK(mark, double, jacobian, K * N);
    WORK(mark, double, change, N_UNKNOWNS);
    const System *system = &instance->scratch.system;
    mechanism_constraints(time, states, inputs_at(instance, time), instance->state.parameters, positions, velocities,
                          jacobian);
    for (int k = 0; k < K; k++) {
        velocities[k] = -velocities[k];
    }
    system_solve(system, missing, velocities, NULL, change);
    for (int j = 0; j < N; j++) {
        states[N + j] += change[j];
        for (int k = 0; k < K; k++) {
            impulse[j] += jacobian[k * N + j] * change[N + k];
        }
    }
    for (int k = 0; k < K; k++) {
        instance->scratch.solver.multipliers[NODES.count - 1][k] += change[N + k];
    }
    arena_release(mark);
}

bool mass_regular(Instance *instance, double time, const double states[], const System *system) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, bool, concerned, N_COORDINATES);
    WORK_OF(mark, Factorization, work);
    double *mass = instance->scratch.mass;
    double mended = 0.0;
    for (int k = 0; k < K; k++) {
        mended = fmax(mended, system->weight[k]);
    }
    if (!(mended > 0.0)) {
        return arena_leave(mark, true);
    }
    mechanism_dynamics(time, states, inputs_at(instance, time), instance->state.parameters, mass,
                       instance->scratch.forcing);
    mass_factorize(mass, work, concerned);
    return arena_leave(mark, report_coordinates(instance, FAILURE_SINGULAR, time, concerned));
}

bool new_states_on_constraints(Instance *instance, Step step) {
    return constraints_drift(instance, step.end, instance->scratch.new_states, inputs_at(instance, step.end)) <=
           ACCEPTED;
}
