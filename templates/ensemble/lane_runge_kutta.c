/* Explicit Runge-Kutta methods in lanes. Source: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I,
   2nd edition, sections II.1 and II.10. */
#include "lane_group.h"
#include "lane_math.h"

static void compute_stages(Group *group, Mask mask, int first, int end) {
    Lanes states[N_STATES], unknowns[N_UNKNOWNS];
    for (int i = first; i < end; i++) {
        const Lanes time = C[i] == 1.0 ? group->end : group->time + C[i] * group->length;
        const bool last = FIRST_SAME_AS_LAST && i == STAGES - 1;
        Lanes *at = last ? group->new_states : states;
        tableau_states(i, group->length, group->states, (const Lanes (*)[N_STATES])group->stages, at);
        group_derivative(group, mask, time, at, unknowns, group->stages[i]);
    }
}

/* Error estimates in units of the tolerance, of formula II.10.17; not a number where a state is none. */
static Lanes errors(const Group *group) {
    const Lanes(*k)[N_STATES] = (const Lanes(*)[N_STATES])group->stages;
    const double tolerance = group->batch->tolerance;
    Lanes error = lanes_of(0.0), second = lanes_of(0.0), finite = lanes_of(0.0);
    for (int i = 0; i < N_STATES; i++) {
        const Lanes size = lanes_max(lanes_abs(group->states[i]), lanes_abs(group->new_states[i]));
        const Lanes unit = 1.0 / (tolerance * (size + group->batch->nominals[i]));
        error = lanes_max(unit * lanes_abs(tableau_error(i, group->length, k)), error);
        finite += 0.0 * group->new_derivatives[i] + 0.0 * group->new_states[i];
        if (SECOND_ESTIMATE) {
            second = lanes_max(unit * lanes_abs(tableau_second_error(i, group->length, k)), second);
        }
    }
    if (SECOND_ESTIMATE) {
        const Lanes ratio = 0.1 * second / error;
        const Mask both = (Mask)(second > 0.0) & (Mask)(error > 0.0);
        error = lanes_select(both, error / lanes_sqrt(1.0 + ratio * ratio), error);
    }
    return error + finite;
}

/* The result of the trial step with its derivatives. */
static void complete(Group *group) {
    Lanes unknowns[N_UNKNOWNS];
    if (!FIRST_SAME_AS_LAST) {
        tableau_states(ALL_STAGES, group->length, group->states, (const Lanes (*)[N_STATES])group->stages,
                       group->new_states);
    } else {
        for (int i = 0; i < N_STATES; i++) {
            group->new_derivatives[i] = group->stages[STAGES - 1][i];
        }
    }
    if (!FIRST_SAME_AS_LAST) {
        group_derivative(group, group->active, group->end, group->new_states, unknowns, group->new_derivatives);
    }
}

Lanes method_try(Group *group) {
    compute_stages(group, group->active, 1, STAGES);
    complete(group);
    return errors(group);
}

void method_dense(Group *group, Mask mask) {
    Lanes terms[DENSE_ROWS + 1];
    if (ALL_STAGES > STAGES) {
        compute_stages(group, mask, STAGES, ALL_STAGES);
    }
    for (int i = 0; i < N_STATES; i++) {
        tableau_dense(i, group->length, (const Lanes (*)[N_STATES])group->stages, terms);
        for (int row = 0; row < DENSE_ROWS; row++) {
            group->dense[HERMITE_TERMS + row][i] = terms[row];
        }
    }
}

void method_begin(Group *group, Mask mask) {
    (void)group; /* these methods remember nothing */
    (void)mask;
}
