#include "observed_flow.h"

#include <math.h>
#include <string.h>

#include "inputs.h"
#include "orthogonal.h"
#include "scale.h"
#include "settings.h"

static const double NODES[4] = {0.0, 0.5, 0.5, 1.0};   /* of the stages; so much of the last slope leads to each */
static const double WEIGHTS[4] = {1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0};
static const double GAUSS = 0.28867513459481288; /* sqrt(3)/6: the nodes of Gauss's rule, from the middle */
enum { MOTION_ORDER = 4 };

static bool without_value(Instance *instance, double time) {
    instance->failure.kind = FAILURE_ESTIMATE;
    instance->failure.time = time;
    return false;
}

/* The slopes from their entries, and the noise of inputs by its densities. */
static void spread_entries(ObserverScratch *work) {
    memset(work->slopes, 0, sizeof work->slopes);
    for (int i = 0; i < N_OBSERVED_ENTRIES; i++) {
        work->slopes[ENTRY_ROWS[i]][ENTRY_COLUMNS[i]] = work->entries[i];
    }
}

bool observed_evaluate(Instance *instance, double time, const double x[], bool slopes) {
    ObserverScratch *work = &instance->scratch.observer;
    const double *inputs = inputs_at(instance, time);
    memcpy(work->parameters, instance->state.parameters, sizeof work->parameters);
    for (int k = 0; k < N_ESTIMATED; k++) {
        work->parameters[ESTIMATED[k]] = x[N_STATES + k];
    }
    if (slopes) {
        observed_slopes(time, x, inputs, work->parameters, work->values, work->entries, work->pivots);
        spread_entries(work);
    } else {
        observed_values(time, x, inputs, work->parameters, work->values, work->pivots);
    }
    bool sound = true;
    for (int i = 0; i < N_OBSERVED_PIVOTS; i++) {
        sound = sound && work->pivots[i] > 0.0;
    }
    for (int i = 0; i < N_OBSERVED_ROWS; i++) {
        sound = sound && isfinite(work->values[i]);
    }
    return sound || without_value(instance, time);
}

/* How many steps lead from start to end (s); 0, with instance->failure, if they are too many. */
static double steps_between(Instance *instance, double start, double end) {
    const double setting = instance->state.settings[SETTING_STEP], span = (end - start) * (1.0 - INSTANT);
    const double longest = setting > 0.0 ? setting : DEFAULT_SOLVER_STEP;
    const double count = span <= longest ? 1.0 : ceil(span / longest);
    if (count <= (double)MOST_SOLVER_STEPS) {
        return count;
    }
    instance->failure.kind = FAILURE_STEP_COUNT;
    instance->failure.time = start;
    instance->failure.amount = count;
    return 0.0;
}

/* One step of h (s) for x alone. */
static bool move_step(Instance *instance, double time, double h, double x[]) {
    const double *rates = instance->scratch.observer.values;
    double stage[N_OBSERVED], sum[N_OBSERVED] = {0.0};
    memcpy(stage, x, sizeof stage);
    for (int s = 0; s < 4; s++) {
        for (int i = 0; i < N_STATES && s > 0; i++) {
            stage[i] = x[i] + NODES[s] * h * rates[i];
        }
        if (!observed_evaluate(instance, time + NODES[s] * h, stage, false)) {
            return false;
        }
        for (int i = 0; i < N_STATES; i++) {
            sum[i] += WEIGHTS[s] * rates[i];
        }
    }
    for (int i = 0; i < N_STATES; i++) {
        x[i] += h * sum[i];
    }
    return true;
}

bool observed_move(Instance *instance, double start, double end, double x[]) {
    const double count = steps_between(instance, start, end), h = (end - start) / count;
    for (double i = 0.0; i < count; i++) {
        if (!move_step(instance, start + i * h, h, x)) {
            return false;
        }
    }
    return count > 0.0;
}

/* product = a (I + part along), where a are the slopes of the rates; the parameters have none. */
static void chain(ObserverScratch *work, double part) {
    memset(work->product, 0, sizeof work->product);
    for (int i = 0; i < N_STATES; i++) {
        double *to = work->product[i];
        for (int k = 0; k < N_OBSERVED; k++) {
            const double slope = work->slopes[i][k];
            if (slope != 0.0) {
                to[k] += slope;
                for (int j = 0; j < N_OBSERVED && part > 0.0; j++) {
                    to[j] += slope * part * work->along[k][j];
                }
            }
        }
    }
    memcpy(work->along, work->product, sizeof work->along);
}

/* Keeps the slopes of the rates in the middle of a step, and where noise comes in there. */
static void keep_middle(const ObserverMemory *memory, ObserverScratch *work) {
    memset(work->middle, 0, sizeof work->middle);
    memset(work->inlet, 0, sizeof work->inlet);
    for (int i = 0; i < N_STATES; i++) {
        memcpy(work->middle[i], work->slopes[i], sizeof work->middle[i]);
        for (int k = 0; k < N_DENSITIES; k++) {
            work->inlet[i][k] = memory->slots[SLOT_DENSITIES + k] * work->slopes[i][N_OBSERVED + k];
        }
    }
    for (int k = 0; k < N_DENSITIES; k++) {
        if (NOISY_STATES[k] >= 0) {
            work->inlet[NOISY_STATES[k]][k] = memory->slots[SLOT_DENSITIES + k];
        }
    }
}

/* grown = exp(middle t) inlet, to the order of the method. */
static void grow(ObserverScratch *work, double t) {
    memcpy(work->grown, work->inlet, sizeof work->grown);
    for (int order = MOTION_ORDER; order > 0; order--) {
        memcpy(work->further, work->inlet, sizeof work->further);
        for (int i = 0; i < N_STATES; i++) {
            for (int j = 0; j < N_OBSERVED; j++) {
                const double part = t / order * work->middle[i][j];
                for (int k = 0; k < N_DENSITIES && part != 0.0; k++) {
                    work->further[i][k] += part * work->grown[j][k];
                }
            }
        }
        memcpy(work->grown, work->further, sizeof work->grown);
    }
}

/* The spread behind a step of h (s): what was there, moved by I + sum, and what the process adds. */
static void spread_step(ObserverScratch *work, double h, double spread[][N_OBSERVED]) {
    enum { WIDTH = N_OBSERVED + 2 * N_DENSITIES };
    for (int i = 0; i < N_OBSERVED; i++) {
        double *row = work->whole + i * WIDTH;
        memcpy(row, spread[i], N_OBSERVED * sizeof(double));
        for (int k = 0; k < N_OBSERVED; k++) {
            for (int j = 0; j < N_OBSERVED; j++) {
                row[j] += work->sum[i][k] * spread[k][j];
            }
        }
    }
    for (int node = 0; node < 2; node++) {
        grow(work, (node == 0 ? 0.5 + GAUSS : 0.5 - GAUSS) * h);
        for (int i = 0; i < N_OBSERVED; i++) {
            for (int k = 0; k < N_DENSITIES; k++) {
                work->whole[i * WIDTH + N_OBSERVED + node * N_DENSITIES + k] = sqrt(h / 2.0) * work->grown[i][k];
            }
        }
    }
    lower_triangular(N_OBSERVED, WIDTH, work->whole);
    for (int i = 0; i < N_OBSERVED; i++) {
        memcpy(spread[i], work->whole + i * WIDTH, N_OBSERVED * sizeof(double));
    }
}

/* One step of h (s). */
static bool flow_step(Instance *instance, double time, double h, double x[], double spread[][N_OBSERVED]) {
    ObserverScratch *work = &instance->scratch.observer;
    double stage[N_OBSERVED], sum[N_OBSERVED] = {0.0};
    memcpy(stage, x, sizeof stage);
    memset(work->sum, 0, sizeof work->sum);
    for (int s = 0; s < 4; s++) {
        for (int i = 0; i < N_STATES && s > 0; i++) {
            stage[i] = x[i] + NODES[s] * h * work->values[i];
        }
        if (!observed_evaluate(instance, time + NODES[s] * h, stage, true)) {
            return false;
        }
        if (s == 1) {
            keep_middle(&instance->state.observer, work);
        }
        chain(work, NODES[s] * h);
        for (int i = 0; i < N_STATES; i++) {
            sum[i] += WEIGHTS[s] * work->values[i];
            for (int j = 0; j < N_OBSERVED; j++) {
                work->sum[i][j] += WEIGHTS[s] * h * work->along[i][j];
            }
        }
    }
    for (int i = 0; i < N_STATES; i++) {
        x[i] += h * sum[i];
    }
    spread_step(work, h, spread);
    return true;
}

bool observed_flow(Instance *instance, double start, double end, double x[], double spread[][N_OBSERVED]) {
    const double count = steps_between(instance, start, end), h = (end - start) / count;
    for (double i = 0.0; i < count; i++) {
        if (!flow_step(instance, start + i * h, h, x, spread)) {
            return false;
        }
    }
    return count > 0.0;
}
