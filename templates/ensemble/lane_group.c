/* Which run a lane has, and the equations at its point. */
#include "lane_group.h"

#include <math.h>
#include <string.h>

#include "lane_equations.h"

static const double SUSPICIOUS = 1e4 * 2.220446049250313e-16; /* of an inertia; PIVOT_SUSPICIOUS of the engine */

void group_inputs(const Group *group, Lanes time, Lanes inputs[]) {
    for (int i = 0; i < N_SIGNALS; i++) {
        inputs[i] = group->knot_inputs[i] + (time - group->knot_time) * group->slopes[i];
    }
}

/* Lanes whose pivots are no better than rounding, or where a constraint is about to be lost. */
static Mask unsound(const Group *group, const Lanes pivots[], const Lanes margins[], const Lanes squares[]) {
    Mask bad = {0};
    for (int i = 0; i < N_COORDINATES; i++) {
        bad |= ~(Mask)(pivots[i] > group->least_pivots[i]);
    }
    for (int k = 0; k < N_CONSTRAINTS; k++) {
        bad |= ~(Mask)(margins[k] > 0.0) | ~(Mask)(squares[k] >= group->squares[k]);
    }
    return bad;
}

static void accelerations(const Group *group, Lanes time, const Lanes states[], const Lanes inputs[], Lanes unknowns[],
                          Lanes pivots[], Lanes margins[], Lanes squares[]) {
    static const double NO_DRIFT[LANES * SIZE_CONSTRAINTS] = {0.0};
    Lanes drift[SIZE_CONSTRAINTS];
    memcpy(drift, NO_DRIFT, sizeof drift);
    lanes_accelerations(time, states, inputs, group->parameters, drift, unknowns, pivots, margins, squares);
}

void group_derivative(Group *group, Mask mask, Lanes time, const Lanes states[], Lanes unknowns[],
                      Lanes derivatives[]) {
    Lanes inputs[SIZE_SIGNALS], pivots[N_COORDINATES], margins[SIZE_CONSTRAINTS], squares[SIZE_CONSTRAINTS];
    group_inputs(group, time, inputs);
    accelerations(group, time, states, inputs, unknowns, pivots, margins, squares);
    group->lost |= mask & unsound(group, pivots, margins, squares);
    for (int i = 0; i < N_COORDINATES; i++) {
        derivatives[i] = states[N_COORDINATES + i];
        derivatives[N_COORDINATES + i] = unknowns[i];
    }
    lanes_further(time, states, inputs, group->parameters, unknowns, derivatives + 2 * N_COORDINATES);
}

void group_begin_constraints(Group *group, Mask mask) {
    static const double STILL_THERE = 1e-3; /* as the scalar engine has it */
    Lanes inputs[SIZE_SIGNALS], unknowns[N_UNKNOWNS];
    Lanes pivots[N_COORDINATES], margins[SIZE_CONSTRAINTS], squares[SIZE_CONSTRAINTS], mass[N_COORDINATES];
    group_inputs(group, group->time, inputs);
    lanes_inertias(group->time, group->states, inputs, group->parameters, mass);
    for (int i = 0; i < N_COORDINATES; i++) {
        lanes_put(&group->least_pivots[i], mask, SUSPICIOUS * lanes_abs(mass[i]));
    }
    if (N_CONSTRAINTS > 0) {
        accelerations(group, group->time, group->states, inputs, unknowns, pivots, margins, squares);
        for (int k = 0; k < N_CONSTRAINTS; k++) {
            lanes_put(&group->squares[k], mask, STILL_THERE * squares[k]);
        }
    }
}

/* Knots of inputs up to which steps may go, and with a fixed step also samples, because it has no dense output. */
void group_limit(Group *group, int lane) {
    const Batch *batch = group->batch;
    const int64_t run = group->run[lane], knot = group->knot[lane];
    const int64_t first = (batch->inputs_apart ? run * batch->knots : 0) + knot;
    const double *from = batch->inputs + first * N_SIGNALS;
    const double here = batch->knot_times[knot];
    const bool last = knot + 1 == batch->knots;
    const double span = last ? 1.0 : batch->knot_times[knot + 1] - here;
    for (int i = 0; i < N_SIGNALS; i++) {
        group->knot_inputs[i][lane] = from[i];
        group->slopes[i][lane] = last || batch->hold ? 0.0 : (from[N_SIGNALS + i] - from[i]) / span;
    }
    group->knot_time[lane] = here;
    double limit = group->stop[lane];
    if (!last && batch->knot_times[knot + 1] < limit) {
        limit = batch->knot_times[knot + 1];
    }
    if (ERROR_ORDER == 0 && group->next_sample[lane] < limit) {
        limit = group->next_sample[lane];
    }
    group->limit[lane] = limit;
    group->begin[lane] = group->time[lane];
    group->done[lane] = 0.0;
    const double rounding = 3.6e-15 * fabs(limit); /* less: a span of 10 steps takes 10 */
    const double whole = (limit - group->time[lane]) * (1.0 - 1e-9) - rounding, step = batch->steps[run];
    group->count[lane] = ERROR_ORDER > 0 || whole <= step ? 1.0 : ceil(whole / step);
}

static void begin_run(Group *group, int lane, int64_t run) {
    const Batch *batch = group->batch;
    group->run[lane] = run;
    group->sample[lane] = group->knot[lane] = group->trials[lane] = group->accepted[lane] = 0;
    group->active[lane] = group->stale[lane] = group->fresh[lane] = -1;
    group->lost[lane] = group->rejected[lane] = 0;
    group->time[lane] = batch->start_time;
    group->stop[lane] = batch->stop_times[run];
    group->next_step[lane] = batch->steps[run];
    group->longest[lane] = batch->longest_steps[run];
    group->previous_log_error[lane] = log(1e-4); /* the value dopri5.f starts from */
    for (int i = 0; i < N_STATES; i++) {
        group->states[i][lane] = batch->starts[run * N_STATES + i];
    }
    for (int i = 0; i < N_PARAMETERS; i++) {
        group->parameters[i][lane] = batch->parameters[run * N_PARAMETERS + i];
    }
    while (group->knot[lane] + 1 < batch->knots && batch->knot_times[group->knot[lane] + 1] <= batch->start_time) {
        group->knot[lane]++;
    }
    group->next_sample[lane] = batch->samples > 0 ? batch->sample_times[0] : HUGE_VAL;
    group_limit(group, lane);
}

void group_fill(Group *group) {
    const Batch *batch = group->batch;
    for (int lane = 0; lane < LANES; lane++) {
        while (!group->active[lane]) {
            const int64_t run = __atomic_load_n(batch->next, __ATOMIC_RELAXED) < batch->runs
                                    ? __atomic_fetch_add(batch->next, 1, __ATOMIC_RELAXED)
                                    : batch->runs;
            if (run >= batch->runs) {
                return;
            }
            if (batch->status[run] == RUN_WAITS) {
                begin_run(group, lane, run);
            }
        }
    }
}

void group_end_runs(Group *group, Mask mask, int64_t status) {
    const Batch *batch = group->batch;
    for (int lane = 0; lane < LANES; lane++) {
        if (mask[lane]) {
            const int64_t run = group->run[lane];
            batch->status[run] = status;
            batch->reached[run] = group->time[lane];
            batch->accepted[run] = group->accepted[lane];
            group->run[lane] = NO_RUN;
        }
    }
    group->active &= ~mask;
    group->stale &= ~mask;
    group->fresh &= ~mask;
    group->lost &= ~mask;
}
