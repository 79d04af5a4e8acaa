/* What an FMU with the solver radau5 does not show: its solver steps, its Jacobian, all residuals of its constraints.

   usage: radau_host adaptive TOLERANCE STOP POINTS   integrates to STOP (s) and prints the solver steps, the greatest
                                                      residuals of positions and velocities at that many communication
                                                      points, and the states
          radau_host fixed TOLERANCE STOP STEPS       the same in that many solver steps of one length,
                                                      whatever their error; the tolerance is that of iterations
          radau_host jacobian STOP                    prints the greatest difference of the Jacobian to difference
                                                      quotients at STOP, relative to its greatest entry */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "derivative.h"
#include "fmi2Functions.h"
#include "integrator.h"
#include "jacobian.h"
#include "solver.h"

typedef struct {
    double positions, velocities; /* greatest absolute values so far */
} Residuals;

static Instance *start(double tolerance) {
    static fmi2CallbackFunctions callbacks;
    const fmi2Component component =
        fmi2Instantiate("it", fmi2CoSimulation, MODEL_GUID, NULL, &callbacks, fmi2False, fmi2False);
    fmi2SetupExperiment(component, fmi2True, tolerance, 0.0, fmi2False, 0.0);
    fmi2EnterInitializationMode(component);
    fmi2ExitInitializationMode(component);
    return component;
}

static void note_residuals(const Instance *instance, Residuals *residuals) {
#if N_CONSTRAINTS > 0
    const State *state = &instance->state;
    double phi[N_HOLONOMIC + 1] = {0.0}, rate[N_CONSTRAINTS], jacobian[N_CONSTRAINTS * N_COORDINATES];
    mechanism_constraints(state->time, state->states, state->inputs, state->parameters, phi, rate, jacobian);
    for (int k = 0; k < N_CONSTRAINTS; k++) {
        residuals->positions = fmax(residuals->positions, k < N_HOLONOMIC ? fabs(phi[k]) : 0.0);
        residuals->velocities = fmax(residuals->velocities, fabs(rate[k]));
    }
#else
    (void)instance;
    (void)residuals;
#endif
}

static void print(int steps, Residuals residuals, const Instance *instance) {
    printf("%d %.3g %.3g", steps, residuals.positions, residuals.velocities);
    for (int i = 0; i < N_STATES; i++) {
        printf(" %.17g", instance->state.states[i]);
    }
}

static int take_adaptive_steps(double tolerance, double stop, int points) {
    Instance *instance = start(tolerance);
    Residuals residuals = {0.0, 0.0};
    for (int i = 0; i < points; i++) {
        const double now = stop * i / points;
        if (fmi2DoStep(instance, now, stop * (i + 1) / points - now, fmi2True) != fmi2OK ||
            !integrator_catch_up(instance)) {
            return 1;
        }
        note_residuals(instance, &residuals);
    }
    print((int)instance->state.steps, residuals, instance);
    fmi2FreeInstance(instance);
    return 0;
}

static int take_fixed_steps(double tolerance, double stop, int count) {
    Instance *instance = start(tolerance);
    State *state = &instance->state;
    Residuals residuals = {0.0, 0.0};
    if (!derivative_at(instance, 0.0, state->states, state->first_stage)) {
        return 1;
    }
    for (int i = 1; i <= count; i++) {
        const Step step = {stop / count, stop * i / count};
        if (!solver_step(instance, step)) {
            return 1;
        }
        state->time = step.end;
        memcpy(state->states, instance->scratch.new_states, sizeof state->states);
        memcpy(state->first_stage, instance->scratch.new_derivatives, sizeof state->first_stage);
        note_residuals(instance, &residuals);
    }
    print(count, residuals, instance);
    fmi2FreeInstance(instance);
    return 0;
}

static int compare_jacobian(double stop) {
    static double jacobian[2 * N_COORDINATES * N_COORDINATES];
    Instance *instance = start(1e-8);
    double states[N_STATES], side[2][N_STATES], difference = 0.0, greatest = 0.0;
    if (fmi2DoStep(instance, 0.0, stop, fmi2True) != fmi2OK || !integrator_catch_up(instance) ||
        !equations_jacobian(instance, stop, instance->state.states, jacobian)) {
        return 1;
    }
    for (int i = 0; i < N_STATES; i++) {
        const double h = 1e-5 * NOMINAL_STATES[i];
        for (int sign = 0; sign < 2; sign++) {
            memcpy(states, instance->state.states, sizeof states);
            states[i] += sign == 0 ? -h : h;
            if (!derivative_at(instance, stop, states, side[sign])) {
                return 1;
            }
        }
        for (int k = 0; k < N_COORDINATES; k++) {
            const double entry = jacobian[i * N_COORDINATES + k];
            const double quotient = (side[1][N_COORDINATES + k] - side[0][N_COORDINATES + k]) / (2.0 * h);
            difference = fmax(difference, fabs(entry - quotient));
            greatest = fmax(greatest, fabs(entry));
        }
    }
    printf("%.3g", difference / greatest);
    fmi2FreeInstance(instance);
    return 0;
}

int main(int count, char *arguments[]) {
    if (count == 5 && strcmp(arguments[1], "adaptive") == 0) {
        return take_adaptive_steps(atof(arguments[2]), atof(arguments[3]), atoi(arguments[4]));
    }
    if (count == 5 && strcmp(arguments[1], "fixed") == 0) {
        return take_fixed_steps(atof(arguments[2]), atof(arguments[3]), atoi(arguments[4]));
    }
    return count == 3 && strcmp(arguments[1], "jacobian") == 0 ? compare_jacobian(atof(arguments[2])) : 2;
}
