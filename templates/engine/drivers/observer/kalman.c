#include "kalman.h"

#include <math.h>
#include <string.h>

#include "observed_flow.h"
#include "observed_manifold.h"
#include "orthogonal.h"

/* to = basis^T from, where from[N_OBSERVED][columns]; rows of `to` have this stride. Without constraints the basis is
   that of the states. */
static void into_basis(double basis[][N_OBSERVED], const double from[], int columns, double to[], int stride) {
    for (int i = 0; i < N_OBSERVED; i++) {
        double *row = to + i * stride;
        memset(row, 0, (size_t)columns * sizeof(double));
        for (int k = N_BOUND > 0 ? 0 : i; k < (N_BOUND > 0 ? N_OBSERVED : i + 1); k++) {
            for (int j = 0; j < columns; j++) {
                row[j] += basis[k][i] * from[k * columns + j];
            }
        }
    }
}

/* product = basis root. */
static void full_root(const ObserverMemory *memory, double product[][N_OBSERVED]) {
    if (N_BOUND == 0) {
        memcpy(product, memory->root, sizeof memory->root);
        return;
    }
    for (int i = 0; i < N_OBSERVED; i++) {
        memset(product[i], 0, N_OBSERVED * sizeof(double));
        for (int k = 0; k < N_OBSERVED; k++) {
            for (int j = 0; j <= k; j++) {
                product[i][j] += memory->basis[i][k] * memory->root[k][j];
            }
        }
    }
}

/* The root in the memory becomes the first columns of the scratch's whole, a matrix of this width, from a row on. */
static void take_root(ObserverMemory *memory, const double *whole, int width) {
    for (int i = 0; i < N_OBSERVED; i++) {
        memcpy(memory->root[i], whole + i * width, N_OBSERVED * sizeof(double));
    }
}

/* The root in the basis follows from the scratch's noise, a lower triangular one of changes of the state. Without
   constraints they are the same. */
static void turn_root(ObserverMemory *memory, ObserverScratch *work) {
    if (N_BOUND == 0) {
        memcpy(memory->root, work->noise, sizeof memory->root);
        return;
    }
    into_basis(memory->basis, &work->noise[0][0], N_OBSERVED, work->whole, N_OBSERVED);
    lower_triangular(N_OBSERVED, N_OBSERVED, work->whole);
    take_root(memory, work->whole, N_OBSERVED);
}

/* They are lengths of rows. */
void kalman_show(Instance *instance) {
    ObserverMemory *memory = &instance->state.observer;
    double (*product)[N_OBSERVED] = instance->scratch.observer.product;
    full_root(memory, product);
    for (int i = 0; i < N_OBSERVED; i++) {
        double square = 0.0;
        for (int j = 0; j < N_OBSERVED; j++) {
            square += product[i][j] * product[i][j];
        }
        memory->slots[SLOT_DEVIATIONS + i] = sqrt(square);
    }
}

bool kalman_start(Instance *instance, double time) {
    ObserverMemory *memory = &instance->state.observer;
    ObserverScratch *work = &instance->scratch.observer;
    if (!observed_project(instance, time, work->estimate) ||
        !observed_basis(instance, time, work->estimate, memory->basis)) {
        return false;
    }
    for (int i = 0; i < N_OBSERVED; i++) {
        for (int j = 0; j < N_OBSERVED; j++) {
            work->whole[i * N_OBSERVED + j] = memory->basis[j][i] * memory->slots[SLOT_STARTS + j];
        }
    }
    lower_triangular(N_OBSERVED, N_OBSERVED, work->whole);
    take_root(memory, work->whole, N_OBSERVED);
    return true;
}

/* ---------------------------------------------------------------------------------------------------- points */

/* How many directions errors have. */
static int freedom(double basis[][N_OBSERVED]) {
    int count = 0;
    for (int j = 0; j < N_OBSERVED; j++) {
        bool some = false;
        for (int i = 0; i < N_OBSERVED; i++) {
            some = some || basis[i][j] != 0.0;
        }
        count += some;
    }
    return count;
}

/* Places the cloud about the estimate: 2 r points of equal weight, each on the constraints. Returns r, 0 if one
   fails. */
static int place_cloud(Instance *instance, double time) {
    ObserverMemory *memory = &instance->state.observer;
    ObserverScratch *work = &instance->scratch.observer;
    const int r = freedom(memory->basis);
    full_root(memory, work->product);
    for (int k = 0; k < 2 * r; k++) {
        const double reach = k < r ? sqrt((double)r) : -sqrt((double)r);
        for (int i = 0; i < N_OBSERVED; i++) {
            work->cloud[k][i] = work->estimate[i] + reach * work->product[i][k % r];
        }
        if (!observed_project(instance, time, work->cloud[k])) {
            return 0;
        }
    }
    return r;
}

/* ---------------------------------------------------------------------------------------------------- motion */

/* The cloud moves, and the estimate becomes its mean; whole, of this width, gets the errors of its points. */
static bool move_cloud(Instance *instance, double start, double end, double basis[][N_OBSERVED], int width) {
    ObserverScratch *work = &instance->scratch.observer;
    const int r = place_cloud(instance, start);
    double mean[N_OBSERVED] = {0.0};
    for (int k = 0; k < 2 * r; k++) {
        if (!observed_move(instance, start, end, work->cloud[k]) ||
            !observed_project(instance, end, work->cloud[k])) {
            return false;
        }
        for (int i = 0; i < N_OBSERVED; i++) {
            mean[i] += work->cloud[k][i] / (2 * r);
        }
    }
    memcpy(work->estimate, mean, sizeof mean);
    if (r == 0 || !observed_project(instance, end, work->estimate) ||
        !observed_basis(instance, end, work->estimate, basis)) {
        return false;
    }
    const double part = 1.0 / sqrt(2.0 * r);
    for (int i = 0; i < N_OBSERVED; i++) {
        memset(work->whole + i * width, 0, (size_t)width * sizeof(double));
        for (int k = 0; k < 2 * r; k++) {
            for (int j = N_BOUND > 0 ? 0 : i; j < (N_BOUND > 0 ? N_OBSERVED : i + 1); j++) {
                work->whole[i * width + k] += basis[j][i] * (work->cloud[k][j] - work->estimate[j]) * part;
            }
        }
    }
    return true;
}

static bool predict_unscented(Instance *instance, double start, double end) {
    enum { WIDTH = N_CLOUD + N_OBSERVED };
    ObserverMemory *memory = &instance->state.observer;
    ObserverScratch *work = &instance->scratch.observer;
    double centre[N_OBSERVED];
    memcpy(centre, work->estimate, sizeof centre);
    if (!observed_noise(instance, start, end, centre, work->noise) ||
        !move_cloud(instance, start, end, memory->basis, WIDTH)) {
        return false;
    }
    into_basis(memory->basis, &work->noise[0][0], N_OBSERVED, work->whole + N_CLOUD, WIDTH);
    lower_triangular(N_OBSERVED, WIDTH, work->whole);
    take_root(memory, work->whole, WIDTH);
    return true;
}

static bool predict_extended(Instance *instance, double start, double end) {
    ObserverMemory *memory = &instance->state.observer;
    ObserverScratch *work = &instance->scratch.observer;
    full_root(memory, work->noise);
    if (!observed_flow(instance, start, end, work->estimate, work->noise) ||
        !observed_project(instance, end, work->estimate) ||
        !observed_basis(instance, end, work->estimate, memory->basis)) {
        return false;
    }
    turn_root(memory, work);
    return true;
}

bool kalman_predict(Instance *instance, double start, double end) {
    return (UNSCENTED ? predict_unscented : predict_extended)(instance, start, end);
}

/* ---------------------------------------------------------------------------------------------------- samples */

/* Fills whole: errors of what is measured, behind columns for its noise, and below them those of the state of the same
   causes. They follow from the slopes at the estimate. */
static bool expect_extended(Instance *instance, double time, int count, const int taken[], double expected[]) {
    const ObserverMemory *memory = &instance->state.observer;
    ObserverScratch *work = &instance->scratch.observer;
    const int width = count + N_SPREAD;
    if (!observed_evaluate(instance, time, work->estimate, OBSERVE_SLOPES)) {
        return false;
    }
    full_root(memory, work->product);
    for (int m = 0; m < count; m++) {
        double *row = work->whole + m * width + count;
        expected[m] = work->values[N_STATES + taken[m]];
        for (int k = 0; k < N_OBSERVED; k++) {
            for (int j = 0; j < N_OBSERVED; j++) {
                row[j] += work->slopes[N_STATES + taken[m]][k] * work->product[k][j];
            }
        }
    }
    for (int i = 0; i < N_OBSERVED; i++) {
        memcpy(work->whole + (count + i) * width + count, memory->root[i], sizeof memory->root[i]);
    }
    return true;
}

/* The same from points. */
static bool expect_unscented(Instance *instance, double time, int count, const int taken[], double expected[]) {
    const ObserverMemory *memory = &instance->state.observer;
    ObserverScratch *work = &instance->scratch.observer;
    const int width = count + N_SPREAD, r = place_cloud(instance, time);
    memset(expected, 0, (size_t)count * sizeof(double));
    for (int k = 0; k < 2 * r; k++) {
        if (!observed_evaluate(instance, time, work->cloud[k], OBSERVE_OUTPUTS)) {
            return false;
        }
        for (int m = 0; m < count; m++) {
            work->seen[k][m] = work->values[N_STATES + taken[m]];
            expected[m] += work->seen[k][m] / (2 * r);
        }
    }
    for (int k = 0; k < 2 * r; k++) {
        for (int m = 0; m < count; m++) {
            work->whole[m * width + count + k] = (work->seen[k][m] - expected[m]) / sqrt(2.0 * r);
        }
        for (int i = 0; i < N_OBSERVED; i++) {
            const double error = memory->root[i][k % r] / sqrt(2.0);
            work->whole[(count + i) * width + count + k] = k < r ? error : -error;
        }
    }
    return r > 0;
}

/* Shows the innovations of what is fresh in the sample, and fills error[N_OBSERVED]: the correction of the estimate in
   its basis. */
static void weigh(Instance *instance, const Sample *sample, const double expected[], double error[]) {
    ObserverMemory *memory = &instance->state.observer;
    const double *whole = instance->scratch.observer.whole;
    const int count = sample->old + sample->fresh, width = count + N_SPREAD;
    double scaled[N_MEASURED];
    for (int m = 0; m < count; m++) {
        const double *row = whole + m * width;
        const double innovation = sample->measured[sample->taken[m]] - expected[m];
        double left = innovation, square = row[m] * row[m];
        for (int k = 0; k < m; k++) {
            left -= row[k] * scaled[k];
            square += row[k] * row[k];
        }
        scaled[m] = left / row[m];
        if (m >= sample->old) {
            memory->slots[SLOT_INNOVATIONS + sample->taken[m]] = innovation;
            memory->slots[SLOT_INNOVATION_DEVIATIONS + sample->taken[m]] = sqrt(square);
            memory->slots[SLOT_SQUARED] += scaled[m] * scaled[m];
        }
    }
    memory->slots[SLOT_DEGREES] += sample->fresh;
    for (int i = 0; i < N_OBSERVED; i++) {
        error[i] = 0.0;
        for (int m = 0; m < count; m++) {
            error[i] += whole[(count + i) * width + m] * scaled[m];
        }
    }
}

/* The estimate moves by the error, and the root behind it, in the basis from before, turns to the basis there. */
static bool move_estimate(Instance *instance, double time, int count, const double error[]) {
    ObserverMemory *memory = &instance->state.observer;
    ObserverScratch *work = &instance->scratch.observer;
    take_root(memory, work->whole + count * (count + N_SPREAD) + count, count + N_SPREAD);
    full_root(memory, work->noise);
    for (int i = 0; i < N_OBSERVED; i++) {
        for (int k = 0; k < N_OBSERVED; k++) {
            work->estimate[i] += memory->basis[i][k] * error[k];
        }
    }
    if (!observed_project(instance, time, work->estimate) ||
        !observed_basis(instance, time, work->estimate, memory->basis)) {
        return false;
    }
    turn_root(memory, work);
    return true;
}

bool kalman_correct(Instance *instance, double time, const Sample *sample) {
    const ObserverMemory *memory = &instance->state.observer;
    ObserverScratch *work = &instance->scratch.observer;
    const int count = sample->old + sample->fresh, width = count + N_SPREAD;
    double expected[N_MEASURED], error[N_OBSERVED];
    memset(work->whole, 0, sizeof work->whole);
    if (!(UNSCENTED ? expect_unscented : expect_extended)(instance, time, count, sample->taken, expected)) {
        return false;
    }
    for (int m = 0; m < count; m++) {
        work->whole[m * width + m] = memory->slots[SLOT_NOISE + sample->taken[m]];
    }
    lower_triangular(count + N_OBSERVED, width, work->whole);
    weigh(instance, sample, expected, error);
    return move_estimate(instance, time, count, error);
}
