/* How residuals are measured: relative to the nominal values of the coordinates. */
#include "constraint_residuals.h"

#include <math.h>
#include <stddef.h>

int rows_of(Level level) {
    return level == POSITIONS ? N_HOLONOMIC : N_CONSTRAINTS;
}

void residuals_evaluate(const Instance *instance, double time, const double states[], const double inputs[],
                        Values *values) {
    mechanism_constraints(time, states, inputs, instance->state.parameters, values->positions, values->velocities,
                          values->jacobian);
}

double residual_unit(Level level, const double states[]) {
    double greatest = 1.0;
    for (int i = 0; level == VELOCITIES && i < N; i++) {
        greatest = fmax(greatest, fabs(states[N + i]) / NOMINAL_STATES[N + i]);
    }
    return greatest;
}

double residual_size(const Values *values, Level level, double unit, const double held[]) {
    double greatest = 0.0;
    for (int k = 0; k < rows_of(level); k++) {
        const double residual = level == POSITIONS ? values->positions[k] : values->velocities[k];
        double scale = 0.0;
        for (int i = 0; i < N; i++) {
            const double change = fabs(values->jacobian[k * N + i]) * NOMINAL_STATES[i];
            scale = change > scale ? change : scale;
        }
        const double share = held == NULL ? 1.0 : 1.0 - held[k];
        const double relative = share * fabs(residual) / (unit * (scale > 0.0 ? scale : 1.0));
        if (!(relative <= greatest)) {
            greatest = isfinite(relative) ? relative : HUGE_VAL;
        }
    }
    return greatest;
}

bool report_constraints(Instance *instance, double time, const Values *values, Level level) {
    instance->failure.kind = FAILURE_CONSTRAINTS;
    instance->failure.imported = false;
    instance->failure.time = time;
    instance->failure.count = rows_of(level);
    for (int k = 0; k < rows_of(level); k++) {
        instance->failure.constraints[k] = k;
        instance->failure.residuals[k] = level == POSITIONS ? values->positions[k] : values->velocities[k];
    }
    return false;
}

double damping_of(double size) {
    return fmin(1.0, size * size);
}
