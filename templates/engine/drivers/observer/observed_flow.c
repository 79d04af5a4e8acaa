#include "observed_flow.h"

#include <math.h>
#include <string.h>

#include "failure.h"
#include "finite.h"
#include "inputs.h"
#include "orthogonal.h"
#include "scale.h"
#include "settings.h"

static const double NODES[4] = {0.0, 0.5, 0.5, 1.0};   /* of the stages, and the weight of the slope before each */
static const double WEIGHTS[4] = {1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0};
static const double GAUSS[2] = {0.78867513459481288, 0.21132486540518712}; /* (3 +- sqrt 3)/6: nodes of his rule */
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

static bool pivots_positive(int count, const double values[]) {
    bool sound = true;
    for (int i = 0; i < count; i++) {
        sound = sound && values[i] > 0.0;
    }
    return sound;
}

bool observed_evaluate(Instance *instance, double time, const double x[], Observe asked) {
    ObserverScratch *work = &instance->scratch.observer;
    const double *inputs = inputs_at(instance, time), *parameters = instance->state.parameters;
    if (N_ESTIMATED > 0) {
        memcpy(work->parameters, parameters, sizeof work->parameters);
        parameters = work->parameters;
    }
    for (int k = 0; k < N_ESTIMATED; k++) {
        work->parameters[ESTIMATED[k]] = x[N_STATES + k];
    }
    bool sound = true;
    if (asked == OBSERVE_OUTPUTS) {
        observed_outputs(time, x, inputs, parameters, work->values);
        sound = all_finite(work->values + N_STATES, N_MEASURED);
    } else if (asked == OBSERVE_RATES) {
        observed_rates(time, x, inputs, parameters, work->values, work->pivots);
        sound = pivots_positive(N_OBSERVED_PIVOTS, work->pivots) && all_finite(work->values, N_STATES);
    } else {
        observed_slopes(time, x, inputs, parameters, work->values, work->entries, work->pivots);
        spread_entries(work);
        sound = pivots_positive(N_OBSERVED_PIVOTS, work->pivots) && all_finite(work->values, N_OBSERVED_ROWS);
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
    report_amount(instance, FAILURE_STEP_COUNT, start, count);
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
        if (!observed_evaluate(instance, time + NODES[s] * h, stage, OBSERVE_RATES)) {
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

/* to[N_STATES] = part middle from, where from[N_OBSERVED]. */
static void grow(const ObserverScratch *work, double part, const double from[], double to[]) {
    for (int i = 0; i < N_STATES; i++) {
        double sum = 0.0;
        for (int j = 0; j < N_OBSERVED; j++) {
            sum += work->middle[i][j] * from[j];
        }
        to[i] = part * sum;
    }
}

/* The noise that the process adds in a step of h (s): exp(middle t) inlet to the order of the method, at the two nodes;
   2 N_DENSITIES columns, in rows of this stride. Behind the first term only the states grow. */
static void add_noise(ObserverScratch *work, double h, double columns[], int stride) {
    const double size = sqrt(h / 2.0);
    for (int k = 0; k < N_DENSITIES; k++) {
        double grown[N_OBSERVED], further[N_OBSERVED] = {0.0}, first = size, second = size;
        for (int i = 0; i < N_OBSERVED; i++) {
            grown[i] = work->inlet[i][k];
            columns[i * stride + k] = columns[i * stride + N_DENSITIES + k] = size * grown[i];
        }
        for (int order = 1; order <= MOTION_ORDER; order++) {
            grow(work, h / order, grown, further);
            memcpy(grown, further, sizeof grown);
            first *= GAUSS[0];
            second *= GAUSS[1];
            for (int i = 0; i < N_STATES; i++) {
                columns[i * stride + k] += first * grown[i];
                columns[i * stride + N_DENSITIES + k] += second * grown[i];
            }
        }
    }
}

/* The spread behind a step of h (s): what was there, moved by I + sum, and what the process adds. */
static void spread_step(ObserverScratch *work, double h, double spread[][N_OBSERVED]) {
    enum { WIDTH = N_OBSERVED + 2 * N_DENSITIES };
    for (int i = 0; i < N_OBSERVED; i++) {
        double *row = work->whole + i * WIDTH;
        memcpy(row, spread[i], N_OBSERVED * sizeof(double));
        for (int k = 0; k < N_OBSERVED; k++) {
            const double part = work->sum[i][k];
            for (int j = 0; j < N_OBSERVED && part != 0.0; j++) {
                row[j] += part * spread[k][j];
            }
        }
    }
    add_noise(work, h, work->whole + N_OBSERVED, WIDTH);
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
        if (!observed_evaluate(instance, time + NODES[s] * h, stage, OBSERVE_SLOPES)) {
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

/* The spread behind a first step of h (s), which begins with none: so only the slopes in its middle count. */
static bool begin_spread(Instance *instance, double time, double h, const double x[], double spread[][N_OBSERVED]) {
    ObserverScratch *work = &instance->scratch.observer;
    double middle[N_OBSERVED];
    memset(spread, 0, N_OBSERVED * sizeof spread[0]);
    if (!observed_evaluate(instance, time, x, OBSERVE_RATES)) {
        return false;
    }
    memcpy(middle, x, sizeof middle);
    for (int i = 0; i < N_STATES; i++) {
        middle[i] = x[i] + 0.5 * h * work->values[i];
    }
    if (!observed_evaluate(instance, time + 0.5 * h, middle, OBSERVE_SLOPES)) {
        return false;
    }
    keep_middle(&instance->state.observer, work);
    if (2 * N_DENSITIES <= N_OBSERVED) { /* its columns have room there */
        add_noise(work, h, spread[0], N_OBSERVED);
        return true;
    }
    memset(work->sum, 0, sizeof work->sum);
    spread_step(work, h, spread);
    return true;
}

int observed_noise(Instance *instance, double start, double end, double x[], double spread[][N_OBSERVED]) {
    const double count = steps_between(instance, start, end), h = (end - start) / count;
    if (!(count > 0.0) || !begin_spread(instance, start, h, x, spread) ||
        (count > 1.0 && !move_step(instance, start, h, x))) {
        return -1;
    }
    for (double i = 1.0; i < count; i++) {
        if (!flow_step(instance, start + i * h, h, x, spread)) {
            return -1;
        }
    }
    return count > 1.0 || 2 * N_DENSITIES > N_OBSERVED ? N_OBSERVED : 2 * N_DENSITIES;
}
