/* The constraints' part of variational integrators, see variational.c.

   A step meets the constraints at its end by forces along G at its stages, the first of which is its begin. Where
   constraints become dependent, as those of a linkage in its fold, no force along G there has the missing direction:
   the discrete equations have no solution, and a step that begins there is discarded. Solvers that project go on. */
#include <math.h>

#include "collocation.h"
#include "constraint_factorization.h"
#include "constraints.h"
#include "failure.h"
#include "inputs.h"
#include "system.h"
#include "variational.h"

enum { N = N_COORDINATES, M = N_CONSTRAINTS, S = STAGES };

static const double MET = 1e-10;            /* relative residuals after a step */
static const double NO_FORCE[N_COORDINATES]; /* zeros */

void stages_guess_multipliers(const System *system, Stages *stages) {
    double below[M];
    double unknowns[N_UNKNOWNS];
    for (int k = 0; k < M; k++) {
        below[k] = -system->gamma[k];
    }
    system_solve(system, system->forcing, below, NULL, unknowns);
    memset(stages->multipliers, 0, sizeof stages->multipliers);
    for (int i = 0; i < S - 1; i++) {
        memcpy(stages->multipliers[i], unknowns + N, sizeof below);
    }
}

void stages_constrain(Instance *instance, double time, const double states[], Stages *stages, int i) {
    double velocities[M];
    double jacobian[M * N];
    mechanism_constraints(time, states, inputs_at(instance, time), instance->state.parameters, stages->residuals[i],
                          velocities, jacobian);
    for (int k = 0; k < M; k++) {
        for (int j = 0; j < N; j++) {
            stages->forces[i][j] += jacobian[k * N + j] * stages->multipliers[i][k];
        }
    }
}

/* The corrections d_j of the multipliers, see stages_meet_constraints. */
static void correct_multipliers(const System *system, double h, double changes[S][N_UNKNOWNS],
                                double residuals[S][M], double d[S][M]) {
    memset(d, 0, S * sizeof d[0]);
    for (int i = 1; i < S; i++) {
        double answer[N_UNKNOWNS];
        system_solve(system, NO_FORCE, residuals[i], NULL, answer);
        for (int k = 0; k < M; k++) {
            double right = -answer[N + k];
            for (int j = 0; j < S; j++) {
                right += h * COLLOCATION.a[i * S + j] * changes[j][N + k];
            }
            for (int j = 0; j < S - 1; j++) {
                d[j][k] += COLLOCATION.multiplier_weights[j * (S - 1) + i - 1] * right / (h * h);
            }
        }
    }
}

/* changes[i] = [x_i, mu_i] solve M x_i = missing_i + G^T mu_i, G x_i = 0. With A = G M^-1 G^T the multipliers change by
   d_j, of which

       h^2 sum_jk a_ij hat_jk A d_k = h sum_j a_ij A mu_j - phi_i,

   and velocities by x_i + M^-1 G^T (h sum_j hat_ij d_j - mu_i). */
void stages_meet_constraints(const System *system, double h, Stages *stages, double changes[S][N_UNKNOWNS]) {
    double d[S][M];
    correct_multipliers(system, h, changes, stages->residuals, d);
    for (int i = 0; i < S; i++) {
        double impulse[M];
        for (int k = 0; k < M; k++) {
            impulse[k] = -changes[i][N + k];
            for (int j = 0; j < S - 1; j++) {
                impulse[k] += h * COLLOCATION.hat[i * S + j] * d[j][k];
            }
            stages->multipliers[i][k] += d[i][k];
        }
        constraints_respond(&system->constraints, impulse, changes[i]);
    }
}

void stages_end_step(Instance *instance, double time, const double missing[], double states[], double impulse[]) {
    const System *system = &instance->scratch.system;
    double positions[M], velocities[M], jacobian[M * N], change[N_UNKNOWNS];
    mechanism_constraints(time, states, inputs_at(instance, time), instance->state.parameters, positions, velocities,
                          jacobian);
    for (int k = 0; k < M; k++) {
        velocities[k] = -velocities[k];
    }
    system_solve(system, missing, velocities, NULL, change);
    for (int j = 0; j < N; j++) {
        states[N + j] += change[j];
        for (int k = 0; k < M; k++) {
            impulse[j] += jacobian[k * N + j] * change[N + k];
        }
    }
}

bool mass_regular(Instance *instance, double time, const double states[], const System *system) {
    double *mass = instance->scratch.mass;
    bool concerned[N_COORDINATES];
    Factorization work;
    double mended = 0.0;
    for (int k = 0; k < M; k++) {
        mended = fmax(mended, system->weight[k]);
    }
    if (!(mended > 0.0)) {
        return true;
    }
    mechanism_dynamics(time, states, inputs_at(instance, time), instance->state.parameters, mass,
                       instance->scratch.forcing);
    mass_factorize(mass, &work, concerned);
    return report_coordinates(instance, FAILURE_SINGULAR, time, concerned);
}

bool new_states_on_constraints(Instance *instance, Step step) {
    return constraints_drift(instance, step.end, instance->scratch.new_states, inputs_at(instance, step.end)) <= MET;
}
