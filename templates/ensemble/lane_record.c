/* What was asked for of a run: values at given times and at the end, extremes, zeros. Nothing else is stored. */
#include <math.h>

#include "lane_equations.h"
#include "lane_group.h"

enum { PARTS = 4, NODES = PARTS + 1 }; /* of a step in which extremes and zeros are looked for */

/* Is there a quantity among these columns that does not follow from states and inputs alone? */
static bool need_rates(const int64_t columns[], int64_t count) {
    for (int64_t i = 0; i < count; i++) {
        if (columns[i] >= AT_UNKNOWNS && columns[i] < AT_SIGNALS) {
            return true;
        }
    }
    return false;
}

/* Sets the quantities at a time (s) and states: with rates all of them, else states and inputs alone. */
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

/* The states within the trial step, theta = 0 ... 1, see dense_output.h of the engine. */
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

/* Extremes: at three nodes, the first of which may lie behind a jump, and at the vertex of the parabola through the
   three. */
static void record_extremes(Group *group, Mask mask, const Lanes first[], const Lanes middle[], const Lanes last[]) {
    const Batch *batch = group->batch;
    for (int64_t i = 0; i < batch->extremes; i++) {
        const int64_t column = batch->extreme_columns[i];
        for (int lane = 0; lane < LANES; lane++) {
            if (mask[lane]) {
                const double a = first[column][lane], b = middle[column][lane], c = last[column][lane];
                const double slope = c - a, bend = a - 2.0 * b + c;
                const int64_t place = group->run[lane] * batch->extremes + i;
                widen(batch, place, a);
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

/* The zero of a quantity in a part of the step, at whose ends it has different signs, by the Illinois variant of regula
   falsi: Dowell, Jarratt, A modified regula falsi method, BIT 11, 1971. */
static Lanes zero_within(Group *group, Mask mask, int64_t column, bool rates, Lanes left, Lanes right, Lanes at_left,
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

/* Notes where a quantity crosses zero in a part of the step at whose ends it has different signs. */
static void note_zeros(Group *group, Mask mask, int64_t crossing, bool rates, Lanes left, Lanes right, Lanes at_left,
                       Lanes at_right) {
    const int64_t column = group->batch->crossing_columns[crossing];
    if (!lanes_any(mask)) {
        return;
    }
    const Lanes theta = zero_within(group, mask, column, rates, left, right, at_left, at_right);
    for (int lane = 0; lane < LANES; lane++) {
        if (mask[lane]) {
            note_crossing(group, lane, crossing, group->time[lane] + theta[lane] * group->length[lane]);
        }
    }
}

/* The polynomial through the values at the nodes, by Newton's forward differences. */
static Lanes through_nodes(const Lanes values[NODES], Lanes theta) {
    Lanes differences[NODES];
    for (int i = 0; i < NODES; i++) {
        differences[i] = values[i];
    }
    for (int order = 1; order < NODES; order++) {
        for (int i = NODES - 1; i >= order; i--) {
            differences[i] -= differences[i - 1];
        }
    }
    Lanes sum = differences[NODES - 1];
    for (int k = NODES - 2; k >= 0; k--) {
        sum = differences[k] + (theta * (double)PARTS - (double)k) * sum / (double)(k + 1);
    }
    return sum;
}

/* Where in a part of the step a quantity of one sign comes nearest to 0, by the polynomial of through_nodes. The mask
   stays set in lanes where this is between the ends of the part, and where the quantity may have another sign there. */
static Lanes nearest(const Lanes values[NODES], int part, Mask *mask) {
    enum { PLACES = 8 };
    static const double NEAR = 0.25; /* of the value at the nearer end */
    const double width = 1.0 / (double)(PARTS * PLACES);
    const Lanes sign = lanes_select(values[part] < 0.0, lanes_of(-1.0), lanes_of(1.0));
    Lanes best = lanes_of((double)part / (double)PARTS), least = lanes_of(HUGE_VAL);
    for (int i = 1; i < PLACES; i++) {
        const Lanes theta = lanes_of((double)part / (double)PARTS + width * (double)i);
        const Lanes value = sign * through_nodes(values, theta);
        const Mask nearer = (Mask)(value < least);
        lanes_put(&best, nearer, theta);
        lanes_put(&least, nearer, value);
    }
    const Lanes before = sign * through_nodes(values, best - width), after = sign * through_nodes(values, best + width);
    const Lanes slope = after - before, bend = before - 2.0 * least + after;
    const Mask turns = (Mask)(bend > 0.0) & (Mask)(lanes_abs(slope) < 2.0 * bend);
    const Lanes vertex = least - slope * slope / (8.0 * bend);
    *mask &= turns & (Mask)(vertex <= NEAR * lanes_min(sign * values[part], sign * values[part + 1]));
    return lanes_select(*mask, best - width * 0.5 * slope / bend, best);
}

/* The zeros of a quantity in a part of the step: one where it changes its sign, two where it has the other sign in
   between. */
static void zeros_in_part(Group *group, Mask mask, int64_t crossing, bool rates, const Lanes values[NODES], int part) {
    const int64_t column = group->batch->crossing_columns[crossing];
    const Lanes left = lanes_of((double)part / (double)PARTS), right = lanes_of((double)(part + 1) / (double)PARTS);
    const Mask differ = (Mask)(values[part] < 0.0) ^ (Mask)(values[part + 1] < 0.0);
    Mask touched = mask & ~differ;
    Lanes quantities[N_QUANTITIES];
    note_zeros(group, mask & differ, crossing, rates, left, right, values[part], values[part + 1]);
    const Lanes turn = nearest(values, part, &touched);
    if (lanes_any(touched)) {
        evaluate_within(group, touched, turn, rates, quantities);
        const Lanes between = quantities[column];
        touched &= (Mask)(between < 0.0) ^ (Mask)(values[part] < 0.0);
        note_zeros(group, touched, crossing, rates, left, turn, values[part], between);
        note_zeros(group, touched, crossing, rates, turn, right, between, values[part + 1]);
    }
}

/* Notes the quantities that have another sign at the start of the step than at the end of the step before: they jump
   with an input. */
static void note_jumps(Group *group, Mask mask, int64_t crossing, Lanes start) {
    const Lanes end = group->at_end[group->batch->crossing_columns[crossing]];
    const Mask jumps = mask & ((Mask)(end < 0.0) ^ (Mask)(start < 0.0));
    for (int lane = 0; lane < LANES && lanes_any(jumps); lane++) {
        if (jumps[lane]) {
            note_crossing(group, lane, crossing, group->time[lane]);
        }
    }
}

/* Signs of zero count as positive; a quantity that is 0 at the start does not cross it there. */
static void record_crossings(Group *group, Mask mask, bool rates, Lanes quantities[NODES][N_QUANTITIES]) {
    const Batch *batch = group->batch;
    const Mask starts = (Mask)(group->time <= batch->start_time);
    for (int64_t i = 0; i < batch->crossings; i++) {
        note_jumps(group, mask & ~starts, i, quantities[0][batch->crossing_columns[i]]);
        Lanes values[NODES];
        for (int k = 0; k < NODES; k++) {
            values[k] = quantities[k][batch->crossing_columns[i]];
        }
        lanes_put(&values[0], starts & (Mask)(values[0] == 0.0) & (Mask)(values[1] < 0.0), lanes_of(-1e-300));
        for (int part = 0; part < PARTS; part++) {
            zeros_in_part(group, mask, i, rates, values, part);
        }
    }
}

/* Extremes and zeros in the trial step, from the quantities at nodes that divide it in equal parts. */
static void record_within(Group *group, Mask mask) {
    const Batch *batch = group->batch;
    Lanes quantities[NODES][N_QUANTITIES];
    const bool rates =
        need_rates(batch->extreme_columns, batch->extremes) || need_rates(batch->crossing_columns, batch->crossings);
    evaluate(group, mask, group->time, group->states, rates, quantities[0]);
    for (int k = 1; k < PARTS; k++) {
        evaluate_within(group, mask, lanes_of((double)k / (double)PARTS), rates, quantities[k]);
    }
    evaluate(group, mask, group->end, group->new_states, rates, quantities[PARTS]);
    for (int k = 2; k <= PARTS; k += 2) {
        record_extremes(group, mask, quantities[k - 2], quantities[k - 1], quantities[k]);
    }
    record_crossings(group, mask, rates, quantities);
    for (int i = 0; i < N_QUANTITIES; i++) {
        lanes_put(&group->at_end[i], mask, quantities[PARTS][i]);
    }
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
