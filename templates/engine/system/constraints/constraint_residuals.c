/* How residuals are measured: relative to the nominal values of the coordinates. */
#include "constraint_residuals.h"

#include <math.h>
#include <stddef.h>

#include "constraint_factorization.h"
#include "scale.h"

int rows_of(Level level) {
    return level == POSITIONS ? N_HOLONOMIC : N_CONSTRAINTS;
}

/* Where a row has become so short that it counts as redundant, its residual is in units of its usual slope at that
   length: relative to what is left of the row, rounding has no bound. */
static double unit_of(const Instance *instance, const Values *values, int k) {
    const IndependentRows *known = &instance->state.rows;
    const double least = instance->state.rows_known ? sqrt(REDUNDANT) * known->slope[k] : 0.0;
    const double unit = fmax(constraints_slope(values->jacobian, k), least);
    return unit > 0.0 ? unit : 1.0;
}

void residuals_evaluate(const Instance *instance, double time, const double states[], const double inputs[],
                        Values *values) {
    mechanism_constraints(time, states, inputs, instance->state.parameters, values->positions, values->velocities,
                          values->jacobian);
    for (int k = 0; k < N_CONSTRAINTS; k++) {
        values->units[k] = unit_of(instance, values, k);
    }
}

/* The greatest velocity in nominal values (1/s). */
static double greatest_speed(const double states[]) {
    double greatest = 0.0;
    for (int i = 0; i < N; i++) {
        greatest = fmax(greatest, fabs(states[N + i]) / NOMINAL_STATES[N + i]);
    }
    return greatest;
}

double residual_unit(Level level, const double states[]) {
    return level == VELOCITIES ? fmax(1.0, greatest_speed(states)) : 1.0;
}

static double residual_of(const Values *values, Level level, int k) {
    return level == POSITIONS ? values->positions[k] : values->velocities[k];
}

double residual_size(const Values *values, Level level, double unit, const double held[]) {
    double greatest = 0.0;
    for (int k = 0; k < rows_of(level); k++) {
        const double share = held == NULL ? 1.0 : 1.0 - held[k];
        const double relative = share * fabs(residual_of(values, level, k)) / (unit * values->units[k]);
        if (!(relative <= greatest)) {
            greatest = isfinite(relative) ? relative : HUGE_VAL;
        }
    }
    return greatest;
}

bool residuals_accepted(const Values *values, Level level, double unit, const ConstraintFactorization *constraints,
                        const double states[], bool last) {
    const double distance = level == VELOCITIES ? sqrt(REDUNDANT) : 0.0, speed = greatest_speed(states);
    for (int place = 0; place < constraints->rows; place++) {
        const int k = constraints->order[place];
        double left = 0.0;
        if (place >= constraints->rank) {
            left = distance * unit * (values->units[k] - constraints_slope(values->jacobian, k));
            for (int i = 0; i < N; i++) {
                left += distance * speed * fabs(values->jacobian[k * N + i]) * NOMINAL_STATES[i];
            }
        }
        const double held = constraints->held[k], share = last && held > 0.0 ? 0.0 : 1.0 - held;
        const double most = left + ACCEPTED * unit * values->units[k];
        if (!(share * fabs(residual_of(values, level, k)) <= most)) {
            return false;
        }
    }
    return true;
}

bool report_constraints(Instance *instance, double time, const Values *values, Level level) {
    instance->failure.kind = FAILURE_CONSTRAINTS;
    instance->failure.imported = false;
    instance->failure.time = time;
    instance->failure.count = rows_of(level);
    double most = 0.0, steepest = 0.0;
    for (int k = 0; k < rows_of(level); k++) {
        instance->failure.constraints[k] = k;
        instance->failure.residuals[k] = residual_of(values, level, k);
        most = fmax(most, fabs(residual_of(values, level, k)));
        steepest = fmax(steepest, values->units[k]);
    }
    instance->failure.flat = most <= ACCEPTED * steepest;
    return false;
}

double damping_of(double size) {
    return fmin(1.0, size * size);
}
