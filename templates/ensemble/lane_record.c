/* What was asked for of a run: values at given times and at the end, extremes, zeros. Nothing else is stored. */
#include <math.h>

#include "lane_equations.h"
#include "lane_group.h"

/* Is anything among these columns that does not follow from states and inputs alone? */
static bool need_rates(const int64_t columns[], int64_t count) {
    for (int64_t i = 0; i < count; i++) {
        if (columns[i] >= AT_UNKNOWNS && columns[i] < AT_SIGNALS) {
            return true;
        }
    }
    return false;
}

/* All quantities at a time (s) and states; those that are not states or inputs only with rates. */
static void evaluate(Group *group, Mask mask, Lanes time, const Lanes states[], bool rates, Lanes quantities[]) {
    Lanes derivatives[N_STATES];
    for (int i = 0; i < N_STATES; i++) {
        quantities[i] = states[i];
    }
    group_inputs(group, time, quantities + AT_SIGNALS);
    if (rates) {
        group_derivative(group, mask, time, states, quantities + AT_UNKNOWNS, derivatives);
        for (int i = 0; i < N_FURTHER; i++) {
            quantities[AT_FURTHER_RATES + i] = derivatives[2 * N_COORDINATES + i];
        }
        lanes_locals(time, states, quantities + AT_SIGNALS, group->parameters, quantities + AT_UNKNOWNS,
                     quantities + AT_LOCALS);
    }
}

/* The states within the trial step, theta = 0 ... 1, see dense_output.h of the runtime. */
static void interpolate(const Group *group, Lanes theta, Lanes states[]) {
    const Lanes factors[2] = {theta, 1.0 - theta};
    for (int i = 0; i < N_STATES; i++) {
        Lanes value = group->dense[DENSE_TERMS - 1][i];
        for (int k = DENSE_TERMS - 2; k >= 0; k--) {
            value = group->dense[k][i] + factors[(k + 1) % 2] * value;
        }
        states[i] = group->states[i] + theta * value;
    }
}

/* All quantities at a part of the trial step, on the constraints. */
static void evaluate_within(Group *group, Mask mask, Lanes theta, bool rates, Lanes quantities[]) {
    Lanes states[N_STATES];
    const Lanes time = group->time + theta * group->length;
    interpolate(group, theta, states);
    if (N_CONSTRAINTS > 0) {
        group_project(group, mask, time, states);
    }
    evaluate(group, mask, time, states, rates, quantities);
}

static void store(const Batch *batch, const Lanes quantities[], int lane, double place[]) {
    for (int64_t i = 0; i < batch->outputs; i++) {
        place[i] = quantities[batch->output_columns[i]][lane];
    }
}

/* Stores a sample of a lane and goes on to the next one. */
static void store_sample(Group *group, const Lanes quantities[], int lane) {
    const Batch *batch = group->batch;
    const int64_t sample = group->sample[lane]++;
    store(batch, quantities, lane, batch->sampled + (group->run[lane] * batch->samples + sample) * batch->outputs);
    group->next_sample[lane] = sample + 1 < batch->samples ? batch->sample_times[sample + 1] : HUGE_VAL;
}

/* Stores the samples up to the end of the step, one of each lane at a time. */
static void record_samples(Group *group, Mask due) {
    const Batch *batch = group->batch;
    const bool rates = need_rates(batch->output_columns, batch->outputs);
    Lanes quantities[N_QUANTITIES];
    while (lanes_any(due)) {
        const Lanes times = lanes_select(due, group->next_sample, group->time);
        evaluate_within(group, due, (times - group->time) / group->length, rates, quantities);
        for (int lane = 0; lane < LANES; lane++) {
            if (due[lane]) {
                store_sample(group, quantities, lane);
            }
        }
        due &= (Mask)(group->next_sample <= group->end);
    }
}

static void widen(const Batch *batch, int64_t place, double value) {
    batch->minima[place] = value < batch->minima[place] ? value : batch->minima[place];
    batch->maxima[place] = value > batch->maxima[place] ? value : batch->maxima[place];
}

/* Extremes: at both ends and in the middle of each step, and at the vertex of the parabola through the three. */
static void record_extremes(Group *group, Mask mask, const Lanes first[], const Lanes middle[], const Lanes last[]) {
    const Batch *batch = group->batch;
    for (int64_t i = 0; i < batch->extremes; i++) {
        const int64_t column = batch->extreme_columns[i];
        for (int lane = 0; lane < LANES; lane++) {
            if (mask[lane]) {
                const double a = first[column][lane], b = middle[column][lane], c = last[column][lane];
                const double slope = c - a, bend = a - 2.0 * b + c;
                const int64_t place = group->run[lane] * batch->extremes + i;
                widen(batch, place, b);
                widen(batch, place, c);
                if (fabs(slope) < 2.0 * fabs(bend)) {
                    widen(batch, place, b - slope * slope / (8.0 * bend));
                }
            }
        }
    }
}

static void note_crossing(Group *group, int lane, int64_t crossing, double time) {
    const Batch *batch = group->batch;
    const int64_t place = group->run[lane] * batch->crossings + crossing;
    const int64_t count = batch->crossing_counts[place]++;
    if (count < batch->most_crossings) {
        batch->crossed[place * batch->most_crossings + count] = time;
    }
}

/* The zero of a quantity in a part of the step whose ends it has different signs at: Illinois's regula falsi. */
static Lanes locate(Group *group, Mask mask, int64_t column, bool rates, Lanes left, Lanes right, Lanes at_left,
                    Lanes at_right) {
    enum { MOST_ROUNDS = 40 };
    Lanes quantities[N_QUANTITIES];
    Lanes theta = left;
    for (int i = 0; i < MOST_ROUNDS; i++) {
        theta = lanes_select(mask, (left * at_right - right * at_left) / (at_right - at_left), theta);
        evaluate_within(group, mask, theta, rates, quantities);
        const Lanes value = quantities[column];
        const Mask before = (Mask)(value * at_left > 0.0);
        const Mask close = (Mask)(lanes_abs(right - left) < 1e-14) | (Mask)(value == 0.0);
        lanes_put(&at_right, mask & before, 0.5 * at_right);
        lanes_put(&at_left, mask & ~before, 0.5 * at_left);
        lanes_put(&left, mask & before, theta);
        lanes_put(&at_left, mask & before, value);
        lanes_put(&right, mask & ~before, theta);
        lanes_put(&at_right, mask & ~before, value);
        mask &= ~close;
        if (!lanes_any(mask)) {
            break;
        }
    }
    return theta;
}

/* Signs of zero count as positive, so that a quantity that begins at 0 is not taken to cross it. */
static void record_crossings(Group *group, Mask mask, bool rates, const Lanes from[], const Lanes to[], double left,
                             double right) {
    const Batch *batch = group->batch;
    for (int64_t i = 0; i < batch->crossings; i++) {
        const int64_t column = batch->crossing_columns[i];
        const Mask crossed = mask & ((Mask)(from[column] < 0.0) ^ (Mask)(to[column] < 0.0));
        if (lanes_any(crossed)) {
            const Lanes theta =
                locate(group, crossed, column, rates, lanes_of(left), lanes_of(right), from[column], to[column]);
            for (int lane = 0; lane < LANES; lane++) {
                if (crossed[lane]) {
                    note_crossing(group, lane, i, group->time[lane] + theta[lane] * group->length[lane]);
                }
            }
        }
    }
}

static void record_within(Group *group, Mask mask) {
    const Batch *batch = group->batch;
    Lanes first[N_QUANTITIES], middle[N_QUANTITIES], last[N_QUANTITIES];
    const bool rates =
        need_rates(batch->extreme_columns, batch->extremes) || need_rates(batch->crossing_columns, batch->crossings);
    evaluate(group, mask, group->time, group->states, rates, first);
    evaluate_within(group, mask, lanes_of(0.5), rates, middle);
    evaluate(group, mask, group->end, group->new_states, rates, last);
    record_extremes(group, mask, first, middle, last);
    record_crossings(group, mask, rates, first, middle, 0.0, 0.5);
    record_crossings(group, mask, rates, middle, last, 0.5, 1.0);
}

void group_record_step(Group *group, Mask mask) {
    const Batch *batch = group->batch;
    const Mask sampled = mask & (Mask)(group->next_sample <= group->end);
    const bool within = batch->extremes + batch->crossings > 0 && lanes_any(mask);
    if (within || lanes_any(sampled)) {
        group_dense(group, within ? mask : sampled);
    }
    if (within) {
        record_within(group, mask);
    }
    if (lanes_any(sampled)) {
        record_samples(group, sampled);
    }
}

void group_record_start(Group *group, Mask mask) {
    const Batch *batch = group->batch;
    Lanes quantities[N_QUANTITIES];
    evaluate(group, mask, group->time, group->states, true, quantities);
    for (int lane = 0; lane < LANES; lane++) {
        if (mask[lane]) {
            const int64_t run = group->run[lane];
            while (group->next_sample[lane] <= group->time[lane]) {
                store_sample(group, quantities, lane);
            }
            for (int64_t i = 0; i < batch->extremes; i++) {
                widen(batch, run * batch->extremes + i, quantities[batch->extreme_columns[i]][lane]);
            }
        }
    }
}

void group_record_end(Group *group, Mask mask) {
    const Batch *batch = group->batch;
    Lanes quantities[N_QUANTITIES];
    evaluate(group, mask, group->time, group->states, need_rates(batch->output_columns, batch->outputs), quantities);
    for (int lane = 0; lane < LANES; lane++) {
        if (mask[lane]) {
            store(batch, quantities, lane, batch->finals + group->run[lane] * batch->outputs);
        }
    }
}
