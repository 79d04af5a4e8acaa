#include "observed_manifold.h"

#include <math.h>
#include <string.h>

#include "observed_flow.h"
#include "orthogonal.h"
#include "scale.h"

/* The first residual among the values of the scratch, and the bound of the Newton steps onto the manifold. */
enum { FIRST_BOUND = N_STATES + N_MEASURED, MOST_MANIFOLD_ROUNDS = 20 };

/* The slopes of the residuals by the first states, as rows of unit length. lengths[SIZE_BOUND] are what they had. */
static void unit_rows(ObserverScratch *work, int columns, double lengths[]) {
    for (int k = 0; k < N_BOUND; k++) {
        double *row = work->rows + k * columns, square = 0.0;
        memcpy(row, work->slopes[FIRST_BOUND + k], (size_t)columns * sizeof(double));
        for (int i = 0; i < columns; i++) {
            square += row[i] * row[i];
        }
        lengths[k] = square > 0.0 ? sqrt(square) : 1.0;
        for (int i = 0; i < columns; i++) {
            row[i] /= lengths[k];
        }
    }
}

bool observed_basis(Instance *instance, double time, const double x[], double basis[][N_OBSERVED]) {
    ObserverScratch *work = &instance->scratch.observer;
    double lengths[SIZE_BOUND], column[N_OBSERVED];
    int kept[SIZE_BOUND], rank = 0;
    if (N_BOUND > 0) {
        if (!observed_evaluate(instance, time, x, OBSERVE_SLOPES)) {
            return false;
        }
        unit_rows(work, N_OBSERVED, lengths);
        rank = reduce_rows(N_BOUND, N_OBSERVED, work->rows, work->reflectors, kept);
    }
    for (int j = 0; j < N_OBSERVED && N_BOUND == 0; j++) {
        memset(basis[j], 0, sizeof basis[j]);
        basis[j][j] = 1.0;
    }
    for (int j = 0; j < N_OBSERVED && N_BOUND > 0; j++) {
        memset(column, 0, sizeof column);
        if (rank + j < N_OBSERVED) {
            column[rank + j] = 1.0;
            turn_back(rank, N_OBSERVED, work->reflectors, column);
        }
        for (int i = 0; i < N_OBSERVED; i++) {
            basis[i][j] = column[i];
        }
    }
    return true;
}

/* The least correction[N_STATES] at the present slopes and residuals. */
static void least_correction(ObserverScratch *work, double correction[]) {
    double lengths[SIZE_BOUND];
    int kept[SIZE_BOUND];
    unit_rows(work, N_STATES, lengths);
    const int rank = reduce_rows(N_BOUND, N_STATES, work->rows, work->reflectors, kept);
    memset(correction, 0, N_STATES * sizeof(double));
    for (int i = 0; i < rank; i++) {
        const double *row = work->rows + kept[i] * N_STATES;
        double left = work->values[FIRST_BOUND + kept[i]] / lengths[kept[i]];
        for (int k = 0; k < i; k++) {
            left -= row[k] * correction[k];
        }
        correction[i] = left / row[i];
    }
    turn_back(rank, N_STATES, work->reflectors, correction);
}

bool observed_project(Instance *instance, double time, double x[]) {
    double correction[N_STATES];
    for (int round = 0; round < MOST_MANIFOLD_ROUNDS && N_BOUND > 0; round++) {
        double moved = 0.0, size = 0.0;
        if (!observed_evaluate(instance, time, x, OBSERVE_SLOPES)) {
            return false;
        }
        least_correction(&instance->scratch.observer, correction);
        for (int i = 0; i < N_STATES; i++) {
            x[i] -= correction[i];
            moved = fmax(moved, fabs(correction[i]));
            size = fmax(size, fabs(x[i]));
        }
        if (moved <= SOLVED * (1.0 + size)) {
            return true;
        }
    }
    if (N_BOUND > 0) {
        instance->failure.kind = FAILURE_ESTIMATE;
        instance->failure.time = time;
    }
    return N_BOUND == 0;
}
