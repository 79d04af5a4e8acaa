/* The answers are those of the system, as if the forces did not depend on them. */
#include "sliding_rows.h"

#include "system.h"

/* Both rows of a contact in space slide if one of them has a direction. */
static bool slides(const State *state, int row) {
    bool found = row_direction(state, row) != 0.0;
    for (int i = 0; i < N_UNILATERALS; i++) {
        if (row >= SLIP_ROWS[i] && row < SLIP_ROWS[i + 1]) {
            for (int k = SLIP_ROWS[i]; k < SLIP_ROWS[i + 1]; k++) {
                found = found || row_direction(state, k) != 0.0;
            }
        }
    }
    return found;
}

int sliding_find(const State *state, int rows[]) {
    int count = 0;
    for (int row = FIRST_SLIP; row < FIRST_LATCH; row++) {
        if (slides(state, row)) {
            rows[count++] = row;
        }
    }
    return count;
}

void sliding_share(const Instance *instance, const System *system, double unknowns[]) {
    if (!multipliers_unique(instance)) {
        multipliers_spread(system, unknowns);
    }
}

void sliding_evaluate(Instance *instance, const System *system, double time, const double states[],
                      const double inputs[], Sliding *sliding) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_OF(mark, ElementRows, rows);
    static const double NOTHING[N_CONSTRAINTS] = {0.0};
    rows_evaluate(instance, time, states, inputs, rows);
    sliding->count = sliding_find(&instance->state, sliding->row);
    for (int k = 0; k < sliding->count; k++) {
        const int row = sliding->row[k];
        system_solve(system, rows->jacobian + row * N, NOTHING, NULL, sliding->answer[k]);
        sliding_share(instance, system, sliding->answer[k]);
        sliding->answer[k][N + ROW_PLACES[row]] = 1.0;
    }
    arena_release(mark);
}

void sliding_change(const Instance *instance, double time, const double states[], const double inputs[],
                    const double unknowns[], const Seed *seed, const double along[], double change[]) {
    mechanism_friction_tangent(time, states, inputs, instance->state.parameters, unknowns, seed->time, seed->states,
                               seed->inputs, seed->parameters, along, change);
}

void sliding_slope(const Instance *instance, double time, const double states[], const double inputs[],
                   const double unknowns[], const Sliding *sliding, double slope[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_ZEROS(mark, double, change, SIZE_FRICTIONAL);
    static const Seed STILL = {.time = 0.0};
    for (int k = 0; k < sliding->count; k++) {
        sliding_change(instance, time, states, inputs, unknowns, &STILL, sliding->answer[k], change);
        for (int i = 0; i < sliding->count; i++) {
            slope[i * sliding->count + k] = (i == k ? 1.0 : 0.0) - change[sliding->row[i] - FIRST_SLIP];
        }
    }
    arena_release(mark);
}
