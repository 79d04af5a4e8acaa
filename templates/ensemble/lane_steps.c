/* Steps in lanes, each with its own length and error control. The rules are those of the scalar engine (step_size.c).
   Sources: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, 2nd edition, sections II.1, II.4 and
   II.10; Hairer, Wanner, Solving Ordinary Differential Equations II, 2nd edition, section IV.2 (the PI controller). */
#include <float.h>
#include <math.h>

#include "lane_group.h"
#include "lane_math.h"
#include "step_control.h"

static const double ERROR_POWER = 1.0 + (ERROR_ORDER < ORDER ? ERROR_ORDER : ORDER);
static const double STEP_ROUNDING = SHORTEST_ROUNDINGS * DBL_EPSILON;

static Lanes weighted_norm(const Group *group, const Lanes v[]) {
    Lanes largest = lanes_of(0.0);
    for (int i = 0; i < N_STATES; i++) {
        const Lanes weight = group->batch->tolerance * (lanes_abs(group->states[i]) + group->batch->nominals[i]);
        largest = lanes_max(largest, lanes_abs(v[i]) / weight);
    }
    return largest;
}

/* x^exponent for x > 0. */
LANE_FUNCTION Lanes power(Lanes x, double exponent) {
    return lanes_exp(exponent * lanes_log(x));
}

void group_first_step(Group *group, Mask mask) {
    Lanes states[N_STATES], derivatives[N_STATES], unknowns[N_UNKNOWNS];
    const Lanes d0 = weighted_norm(group, group->states), d1 = weighted_norm(group, group->stages[0]);
    const Mask resting = (Mask)(d0 < RESTING) | (Mask)(d1 < RESTING);
    const Lanes h0 = lanes_select(resting, RESTING_PART * (group->stop - group->time), FIRST_PART * d0 / d1);
    for (int i = 0; i < N_STATES; i++) {
        states[i] = group->states[i] + h0 * group->stages[0][i];
    }
    group_derivative(group, mask, group->time + h0, states, unknowns, derivatives);
    for (int i = 0; i < N_STATES; i++) {
        derivatives[i] = (derivatives[i] - group->stages[0][i]) / h0;
    }
    const Lanes largest = lanes_max(d1, weighted_norm(group, derivatives));
    const Lanes h1 = lanes_select(largest <= NO_CHANGE, h0, power(FIRST_PART / largest, 1.0 / ERROR_POWER));
    lanes_put(&group->next_step, mask, lanes_min(FIRST_GROWTH * h0, h1));
}

/* The trial step: its length and where it ends. Returns where it ends at the limit though a longer one is proposed. */
static Mask choose_steps(Group *group) {
    const Lanes remaining = group->limit - group->time;
    if (ERROR_ORDER == 0) {
        const Lanes done = group->done + 1.0;
        const Lanes next = group->begin + (group->limit - group->begin) * (done / group->count);
        group->end = lanes_select(done < group->count, next, group->limit);
        group->length = (group->limit - group->begin) / group->count;
        return (Mask){0};
    }
    const Lanes proposed = lanes_min(group->next_step, group->longest);
    const Mask whole = (Mask)(remaining <= STRETCH * proposed) & (Mask)(remaining <= MAX_STEP_SLACK * group->longest);
    const Lanes next = group->time + proposed;
    group->end = lanes_select(whole, group->limit, next);
    group->length = lanes_select(whole, remaining, next - group->time);
    return whole & (Mask)(remaining < proposed);
}

static void propose(Group *group, Mask good, Mask short_of_limit, Lanes error) {
    const double beta = REMEMBERED_EXPONENT / ERROR_POWER, alpha = 1.0 / ERROR_POWER - REMEMBERED_SHARE * beta;
    const Lanes log_error = lanes_log(lanes_max(error, lanes_of(1e-300)));
    Lanes factor = SAFETY * lanes_exp(beta * group->previous_log_error - alpha * log_error);
    factor = lanes_max(factor, lanes_of(LARGEST_REDUCTION));
    factor = lanes_min(factor, lanes_select(group->rejected, lanes_of(1.0), lanes_of(LARGEST_GROWTH)));
    const Lanes next = factor * group->length;
    lanes_put(&group->next_step, good & short_of_limit, lanes_max(group->next_step, next));
    lanes_put(&group->next_step, good & ~short_of_limit, next);
    lanes_put(&group->previous_log_error, good & ~short_of_limit, lanes_max(log_error, lanes_of(log(SMALLEST_ERROR))));
}

static void propose_shorter(Group *group, Mask bad, Lanes error) {
    const Mask measured = (Mask)(error > 1.0) & (Mask)(error < HUGE_VAL);
    const Lanes usual = SAFETY * power(lanes_select(measured, error, lanes_of(1.0)), -1.0 / ERROR_POWER);
    const Lanes factor = lanes_select(measured, usual, lanes_of(UNMEASURED_REDUCTION));
    lanes_put(&group->next_step, bad, lanes_max(factor, lanes_of(LARGEST_REDUCTION)) * group->length);
}

/* The end of the step becomes the present point. */
static void accept(Group *group, Mask good) {
    for (int i = 0; i < N_STATES; i++) {
        lanes_put(&group->states[i], good, group->new_states[i]);
        lanes_put(&group->stages[0][i], good, group->new_derivatives[i]);
    }
    lanes_put(&group->time, good, group->end);
    group->done += 1.0;
    const Mask ended = good & (Mask)(group->time >= group->limit);
    if (!lanes_any(ended)) {
        return;
    }
    for (int lane = 0; lane < LANES; lane++) {
        const Batch *batch = group->batch;
        if (ended[lane] && group->time[lane] < group->stop[lane]) {
            const int64_t next = group->knot[lane] + 1;
            if (next < batch->knots && batch->knot_times[next] <= group->time[lane]) {
                group->knot[lane] = next;
                group->stale[lane] = -1;
            }
            group_limit(group, lane);
        }
    }
}

/* Constraints move the result; its derivatives are taken anew there. */
static void bring_back(Group *group, Mask good) {
    Lanes unknowns[N_UNKNOWNS], derivatives[N_STATES];
    const Mask moved = N_CONSTRAINTS > 0 ? group_project(group, good, group->end, group->new_states) : (Mask){0};
    if (lanes_any(moved)) {
        group_derivative(group, moved, group->end, group->new_states, unknowns, derivatives);
        for (int i = 0; i < N_STATES; i++) {
            lanes_put(&group->new_derivatives[i], moved, derivatives[i]);
        }
    }
}

void group_step(Group *group) {
    static const int64_t MOST_TRIALS = 10000000;
    const Mask short_of_limit = choose_steps(group);
    const Lanes error = method_try(group);
    Mask good = group->active & (ERROR_ORDER > 0 ? (Mask)(error <= 1.0) : (Mask)(error == error)) & ~group->lost;
    bring_back(group, good);
    good &= ~group->lost;
    if (ERROR_ORDER > 0) {
        const Mask bad = group->active & ~good;
        propose(group, good, short_of_limit, error);
        if (lanes_any(bad)) {
            propose_shorter(group, bad, error);
        }
        group->rejected = lanes_bits(lanes_select(good, lanes_of(0.0), lanes_from_bits(group->rejected | bad)));
        group->lost |= bad & (Mask)(group->next_step < STEP_ROUNDING * lanes_max(lanes_abs(group->time), group->stop));
    } else {
        group->lost |= group->active & ~good;
    }
    group->trials += 1;
    group->accepted -= good; /* a mask is -1 where it is set */
    group->lost |= group->active & (Mask)(group->trials > MOST_TRIALS);
    group_record_step(group, good);
    accept(group, good);
}

void group_dense(Group *group, Mask mask) {
    for (int i = 0; i < N_STATES; i++) {
        const Lanes rise = group->new_states[i] - group->states[i];
        const Lanes bend = group->length * group->stages[0][i] - rise;
        group->dense[0][i] = rise;
        group->dense[1][i] = bend;
        group->dense[2][i] = rise - group->length * group->new_derivatives[i] - bend;
    }
    method_dense(group, mask);
}
