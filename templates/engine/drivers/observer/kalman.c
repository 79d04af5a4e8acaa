#include "kalman.h"

#include <math.h>
#include <string.h>

#include "observed_flow.h"
#include "observed_manifold.h"
#include "orthogonal.h"

/* to = basis^T from, both with `columns` columns; a row of `to` begins `stride` numbers behind the one before. Without
   constraints the basis is that of the states. */
static void into_basis(double basis[][N_OBSERVED], double from[][N_OBSERVED], int columns, double to[], int stride) {
    for (int i = 0; i < N_OBSERVED; i++) {
        double *row = to + i * stride;
        memset(row, 0, (size_t)columns * sizeof(double));
        for (int k = N_BOUND > 0 ? 0 : i; k < (N_BOUND > 0 ? N_OBSERVED : i + 1); k++) {
            for (int j = 0; j < columns; j++) {
                row[j] += basis[k][i] * from[k][j];
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
    into_basis(memory->basis, work->noise, N_OBSERVED, work->whole, N_OBSERVED);
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
    for (int j = 0; j < N_OBSERVED && N_BOUND > 0; j++) {
        bool some = false;
        for (int i = 0; i < N_OBSERVED; i++) {
            some = some || basis[i][j] != 0.0;
        }
        count += some;
    }
    return N_BOUND > 0 ? count : N_OBSERVED;
}

/* How many points stand for errors along r directions. */
static int points_for(int r) {
    return SIMPLEX ? r + 1 : 2 * r;
}

/* Fills reaches[r][points_for(r)]: the places of points along directions, in standard deviations, of mean 0 and
   variance 1. The points are pairs, or the corners of a regular simplex, one direction after the other. */
static void fill_reaches(int r, double reaches[][N_CLOUD]) {
    for (int j = 0; j < r; j++) {
        memset(reaches[j], 0, sizeof reaches[j]);
        if (!SIMPLEX) {
            reaches[j][j] = sqrt((double)r);
            reaches[j][r + j] = -reaches[j][j];
            continue;
        }
        const double part = sqrt((r + 1.0) / ((j + 1.0) * (j + 2.0)));
        for (int k = 0; k <= j; k++) {
            reaches[j][k] = part;
        }
        reaches[j][j + 1] = -(j + 1.0) * part;
    }
}

/* Places the cloud about the estimate: points of equal weight for r directions, each on the constraints. Returns r, 0
   if one fails. */
static int place_cloud(Instance *instance, double time) {
    ObserverMemory *memory = &instance->state.observer;
    ObserverScratch *work = &instance->scratch.observer;
    const int r = freedom(memory->basis);
    full_root(memory, work->product);
    if (work->reached != r) {
        fill_reaches(r, work->reaches);
        work->reached = r;
    }
    double along[N_OBSERVED][N_OBSERVED]; /* by direction */
    for (int j = 0; j < r; j++) {
        for (int i = 0; i < N_OBSERVED; i++) {
            along[j][i] = work->product[i][j];
        }
    }
    for (int k = 0; k < points_for(r); k++) {
        double point[N_OBSERVED];
        memcpy(point, work->estimate, sizeof point);
        for (int j = 0; j < r; j++) {
            const double reach = work->reaches[j][k];
            if (reach != 0.0) {
                for (int i = 0; i < N_OBSERVED; i++) {
                    point[i] += reach * along[j][i];
                }
            }
        }
        memcpy(work->cloud[k], point, sizeof point);
    }
    for (int k = 0; k < points_for(r); k++) {
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
    const int r = place_cloud(instance, start), count = points_for(r);
    double mean[N_OBSERVED] = {0.0};
    for (int k = 0; r > 0 && k < count; k++) {
        if (!observed_move(instance, start, end, work->cloud[k]) ||
            !observed_project(instance, end, work->cloud[k])) {
            return false;
        }
        for (int i = 0; i < N_OBSERVED; i++) {
            mean[i] += work->cloud[k][i] / count;
        }
    }
    memcpy(work->estimate, mean, sizeof mean);
    if (r == 0 || !observed_project(instance, end, work->estimate) ||
        !observed_basis(instance, end, work->estimate, basis)) {
        return false;
    }
    const double part = 1.0 / sqrt((double)count);
    for (int k = 0; k < count; k++) {
        for (int i = 0; i < N_OBSERVED; i++) {
            work->cloud[k][i] = (work->cloud[k][i] - work->estimate[i]) * part;
        }
    }
    for (int i = 0; i < N_OBSERVED; i++) {
        double *row = work->whole + i * width;
        memset(row, 0, (size_t)width * sizeof(double));
        for (int k = 0; k < count; k++) {
            row[k] = N_BOUND > 0 ? 0.0 : work->cloud[k][i];
            for (int j = 0; j < N_OBSERVED && N_BOUND > 0; j++) {
                row[k] += basis[j][i] * work->cloud[k][j];
            }
        }
    }
    return true;
}

static bool predict_unscented(Instance *instance, double start, double end) {
    ObserverMemory *memory = &instance->state.observer;
    ObserverScratch *work = &instance->scratch.observer;
    double centre[N_OBSERVED];
    memcpy(centre, work->estimate, sizeof centre);
    const int noisy = observed_noise(instance, start, end, centre, work->noise), width = N_CLOUD + noisy;
    if (noisy < 0 || !move_cloud(instance, start, end, memory->basis, width)) {
        return false;
    }
    into_basis(memory->basis, work->noise, noisy, work->whole + N_CLOUD, width);
    lower_triangular(N_OBSERVED, width, work->whole);
    take_root(memory, work->whole, width);
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

/* Fills expected[count], and rows of the whole: errors of what is measured, behind columns for its noise, of the same
   causes as those of the state, which are the root. They follow from the slopes at the estimate. */
static bool expect_extended(Instance *instance, double time, int count, const int taken[], double expected[]) {
    ObserverScratch *work = &instance->scratch.observer;
    if (!observed_evaluate(instance, time, work->estimate, OBSERVE_SLOPES)) {
        return false;
    }
    full_root(&instance->state.observer, work->product);
    for (int m = 0; m < count; m++) {
        double *row = work->whole + m * (count + N_OBSERVED) + count;
        expected[m] = work->values[N_STATES + taken[m]];
        for (int k = 0; k < N_OBSERVED; k++) {
            for (int j = 0; j < N_OBSERVED; j++) {
                row[j] += work->slopes[N_STATES + taken[m]][k] * work->product[k][j];
            }
        }
    }
    return true;
}

/* The part of what is measured at points, left[points] by their number, that errors of the state along r directions do
   not explain, comes to the noise in a row. The corners of a simplex leave none. */
static void add_unexplained(ObserverScratch *work, int r, int count, int m, double left[], double row[]) {
    const int points = points_for(r);
    double *rest = work->rest + m * (count + N_CLOUD);
    memset(rest, 0, (size_t)(count + N_CLOUD) * sizeof(double));
    rest[m] = row[m];
    for (int k = 0; k < points; k++) {
        for (int j = 0; j < r; j++) {
            left[k] -= work->reaches[j][k] * row[count + j] / points;
        }
        rest[count + k] = left[k] * sqrt((double)points);
    }
}

/* The same from points. */
static bool expect_unscented(Instance *instance, double time, int count, const int taken[], double expected[]) {
    ObserverScratch *work = &instance->scratch.observer;
    const int width = count + N_OBSERVED, r = place_cloud(instance, time), points = points_for(r);
    const double part = r > 0 ? 1.0 / points : 0.0;
    double left[N_CLOUD];
    for (int k = 0; r > 0 && k < points; k++) {
        if (!observed_evaluate(instance, time, work->cloud[k], OBSERVE_OUTPUTS)) {
            return false;
        }
        memcpy(work->seen[k], work->values + N_STATES, sizeof work->seen[k]);
    }
    for (int m = 0; m < count; m++) {
        double *row = work->whole + m * width, mean = 0.0;
        for (int k = 0; k < points; k++) {
            mean += part * work->seen[k][taken[m]];
        }
        for (int k = 0; k < points; k++) {
            left[k] = part * (work->seen[k][taken[m]] - mean);
        }
        for (int j = 0; j < r; j++) {
            double sum = 0.0;
            for (int k = 0; k < points; k++) {
                sum += work->reaches[j][k] * left[k];
            }
            row[count + j] = sum;
        }
        expected[m] = mean;
        if (!SIMPLEX) {
            add_unexplained(work, r, count, m, left, row);
        }
    }
    for (int m = 0; m < count && !SIMPLEX; m++) {
        if (m == 0) {
            lower_triangular(count, count + N_CLOUD, work->rest);
        }
        memcpy(work->whole + m * width, work->rest + m * (count + N_CLOUD), (size_t)count * sizeof(double));
    }
    return r > 0;
}

/* Shows the innovations of what is fresh in the sample, and fills error[N_OBSERVED]: the correction of the estimate in
   its basis. */
static void weigh(Instance *instance, const Sample *sample, const double expected[], double error[]) {
    ObserverMemory *memory = &instance->state.observer;
    const double *whole = instance->scratch.observer.whole;
    const int count = sample->old + sample->fresh, width = count + N_OBSERVED;
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
    take_root(memory, work->whole + count * (count + N_OBSERVED) + count, count + N_OBSERVED);
    if (N_BOUND == 0) {
        for (int i = 0; i < N_OBSERVED; i++) {
            work->estimate[i] += error[i];
        }
        return true;
    }
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
    const int count = sample->old + sample->fresh, width = count + N_OBSERVED;
    double expected[N_MEASURED], error[N_OBSERVED];
    memset(work->whole, 0, (size_t)(width * width) * sizeof(double));
    for (int m = 0; m < count; m++) {
        work->whole[m * width + m] = memory->slots[SLOT_NOISE + sample->taken[m]];
    }
    for (int i = 0; i < N_OBSERVED; i++) {
        memcpy(work->whole + (count + i) * width + count, memory->root[i], sizeof memory->root[i]);
    }
    if (!(UNSCENTED ? expect_unscented : expect_extended)(instance, time, count, sample->taken, expected)) {
        return false;
    }
    lower_triangular(count + N_OBSERVED, width, work->whole);
    weigh(instance, sample, expected, error);
    return move_estimate(instance, time, count, error);
}
