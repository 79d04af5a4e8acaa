/* Judging a State that comes from outside. */
#include "state.h"

static bool counts(int64_t number) {
    return number >= 0 && number <= INT64_MAX / 2; /* no run reaches such counts */
}

/* Are the numbers of the constraints a permutation? */
static bool is_order(const int64_t order[]) {
    bool met[SIZE_CONSTRAINTS] = {false};
    for (int k = 0; k < N_CONSTRAINTS; k++) {
        if (order[k] < 0 || order[k] >= N_CONSTRAINTS || met[order[k]]) {
            return false;
        }
        met[order[k]] = true;
    }
    return true;
}

/* Are all modes those that the elements may have, and their impacts counts? */
static bool modes_in_range(const State *state) {
    for (int i = 0; i < N_UNILATERALS + N_FRICTIONS; i++) {
        const int64_t least = i < N_UNILATERALS ? MODE_OPEN : MODE_STICKS;
        if (state->modes[i] < least || state->modes[i] > MODE_SLIDES_BACKWARD) {
            return false;
        }
    }
    for (int i = 0; i < N_UNILATERALS; i++) {
        if (!counts(state->impacts[i])) {
            return false;
        }
    }
    return true;
}

bool state_in_range(const State *state) {
    return counts(state->steps) && counts(state->stiff_steps) && counts(state->easy_steps) && state->rows.rank >= 0 &&
           state->rows.rank <= N_CONSTRAINTS && (!state->rows_known || is_order(state->rows.order)) &&
           modes_in_range(state) && observer_memory_in_range(&state->observer);
}
