/* Moving states onto the constraints the shortest way, measured by M, by a simplified Newton iteration: Hairer, Wanner,
   Solving Ordinary Differential Equations II, 2nd edition, section VII.2. Lanes that are there already rest. */
#include <string.h>

#include "lane_equations.h"
#include "lane_group.h"
#include "lane_math.h"

enum { M = N_CONSTRAINTS, SIZE_M = SIZE_CONSTRAINTS, MOST_CORRECTIONS = 12 };

static const double ROUNDING = 1e-13; /* relative residuals that are as good as zero */
static const double ACCEPTED = 1e-10; /* relative residuals that are met where rounding leaves more */

/* What a correction takes: G and M^-1 G^T at a point, and the Cholesky factor of G M^-1 G^T. */
typedef struct {
    Lanes reach[SIZE_M][N_COORDINATES]; /* M^-1 G^T, a row a constraint */
    Lanes lower[SIZE_M][SIZE_M];
} Metric;

typedef struct {
    Lanes positions[SIZE_M], velocities[SIZE_M], jacobian[SIZE_M * N_COORDINATES];
} Residuals;

/* The Cholesky factor of the first rows; lanes where it is none become lost. */
static void factorize(Group *group, Mask mask, int rows, const Lanes jacobian[], Metric *metric) {
    for (int i = 0; i < rows; i++) {
        for (int j = 0; j <= i; j++) {
            Lanes sum = lanes_of(0.0);
            for (int k = 0; k < N; k++) {
                sum += jacobian[i * N + k] * metric->reach[j][k];
            }
            const Lanes whole = sum;
            for (int k = 0; k < j; k++) {
                sum -= metric->lower[i][k] * metric->lower[j][k];
            }
            if (i == j) {
                group->lost |= mask & ~(Mask)(sum > 1e-10 * whole);
                metric->lower[i][i] = lanes_sqrt(sum);
            } else {
                metric->lower[i][j] = sum / metric->lower[j][j];
            }
        }
    }
}

static void find_metric(Group *group, Mask mask, int rows, Lanes time, const Lanes states[], const Lanes inputs[],
                        Metric *metric) {
    Lanes factor[SIZE_FACTOR], pivots[N_COORDINATES], forcing[N_COORDINATES];
    Lanes jacobian[SIZE_M * N_COORDINATES], gamma[SIZE_M];
    lanes_constrained(time, states, inputs, group->parameters, factor, pivots, forcing, jacobian, gamma);
    for (int i = 0; i < N; i++) {
        group->lost |= mask & ~(Mask)(pivots[i] > group->least_pivots[i]);
    }
    for (int k = 0; k < rows; k++) {
        lanes_solve(factor, jacobian + k * N, metric->reach[k]);
    }
    factorize(group, mask, rows, jacobian, metric);
}

/* states += the change that takes the residuals away to first order, in the lanes of the mask. */
static void correct(const Metric *metric, Mask mask, int rows, const Lanes residuals[], Lanes states[]) {
    Lanes forces[SIZE_M];
    for (int i = 0; i < rows; i++) {
        Lanes sum = -residuals[i];
        for (int k = 0; k < i; k++) {
            sum -= metric->lower[i][k] * forces[k];
        }
        forces[i] = sum / metric->lower[i][i];
    }
    for (int i = rows - 1; i >= 0; i--) {
        for (int k = i + 1; k < rows; k++) {
            forces[i] -= metric->lower[k][i] * forces[k];
        }
        forces[i] /= metric->lower[i][i];
    }
    for (int i = 0; i < N; i++) {
        Lanes change = lanes_of(0.0);
        for (int k = 0; k < rows; k++) {
            change += metric->reach[k][i] * forces[k];
        }
        lanes_put(&states[i], mask, states[i] + change);
    }
}

/* The greatest residual relative to what a change of a coordinate by its nominal value makes, velocities also relative
   to the greatest velocity in nominal values, at least 1/s. */
static Lanes size_of(const Group *group, int rows, const Residuals *found, const Lanes residuals[],
                     const Lanes states[]) {
    const double *nominals = group->batch->nominals;
    Lanes greatest = lanes_of(0.0), pace = lanes_of(1.0);
    for (int i = 0; i < N && residuals == found->velocities; i++) {
        pace = lanes_max(pace, lanes_abs(states[N + i]) / nominals[N + i]);
    }
    for (int k = 0; k < rows; k++) {
        Lanes scale = lanes_of(0.0);
        for (int i = 0; i < N; i++) {
            scale = lanes_max(scale, lanes_abs(found->jacobian[k * N + i]) * nominals[i]);
        }
        scale = lanes_select(scale > 0.0, scale, lanes_of(1.0));
        const Lanes relative = lanes_abs(residuals[k]) / (pace * scale);
        greatest = lanes_select(relative <= greatest, greatest, relative); /* not a number wins */
    }
    return greatest;
}

/* One level: the positions, with the first N_HOLONOMIC rows, or the velocities. Returns the lanes that were moved. */
static Mask project(Group *group, Mask mask, bool velocities, Lanes time, const Lanes inputs[], Lanes states[]) {
    Residuals found;
    Metric metric;
    const int rows = velocities ? M : N_HOLONOMIC;
    const Lanes *residuals = velocities ? found.velocities : found.positions;
    Mask moved = {0}, open = mask;
    Lanes previous = lanes_of(HUGE_VAL);
    memset(&metric, 0, sizeof metric);
    for (int i = 0; i <= MOST_CORRECTIONS; i++) {
        lanes_constraints(time, states, inputs, group->parameters, found.positions, found.velocities, found.jacobian);
        const Lanes size = size_of(group, rows, &found, residuals, states);
        const Mask still = (Mask)(size <= ACCEPTED) & (Mask)(size > 0.5 * previous);
        open &= ~((Mask)(size <= ROUNDING) | still);
        if (!lanes_any(open)) {
            return moved;
        }
        if (i == 0) {
            find_metric(group, open, rows, time, states, inputs, &metric);
        }
        correct(&metric, open, rows, residuals, velocities ? states + N : states);
        moved |= open;
        lanes_put(&previous, open, size);
    }
    group->lost |= open;
    return moved;
}

Mask group_project(Group *group, Mask mask, Lanes time, Lanes states[]) {
    Lanes inputs[SIZE_SIGNALS];
    group_inputs(group, time, inputs);
    const Mask moved = N_HOLONOMIC > 0 ? project(group, mask, false, time, inputs, states) : (Mask){0};
    return moved | project(group, mask, true, time, inputs, states);
}
