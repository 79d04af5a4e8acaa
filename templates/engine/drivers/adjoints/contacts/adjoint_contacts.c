/* contacts_answer backwards: z = s along the seed and the answer, which the forces z change. */
#include <string.h>

#include "adjoint_parts.h"
#include "contact_modes.h"
#include "lu.h"
#include "seeds.h"
#include "sliding_rows.h"

/* rows[count] for weights[count] of the forces; false if there is no definite answer. */
static bool solve_transposed(const Instance *instance, const Sliding *sliding, const double weights[], double rows[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, slope, SIZE_FRICTIONAL * SIZE_FRICTIONAL);
    WORK(mark, double, transposed, SIZE_FRICTIONAL * SIZE_FRICTIONAL);
    WORK(mark, int, order, SIZE_FRICTIONAL);
    const State *state = &instance->state;
    const int count = sliding->count;
    sliding_slope(instance, state->time, state->states, state->inputs, instance->cache.accelerations, sliding, slope);
    for (int i = 0; i < count; i++) {
        for (int k = 0; k < count; k++) {
            transposed[k * count + i] = slope[i * count + k];
        }
    }
    if (!lu_factorize(transposed, order, count)) {
        return arena_leave(mark, false);
    }
    lu_solve(transposed, order, count, weights, rows);
    return arena_leave(mark, true);
}

/* A velocity beyond all slips, m/s or rad/s. */
static const double BEYOND_SLIPS = 1e9;

/* directed[N_PARAMETERS]: the parameters, in which contacts in space that do not slide have a direction too. Without
   one the derivatives of their forces are 0/0, which weights of 0 do not cancel. */
static void direct_all(const State *state, double directed[]) {
    memcpy(directed, state->parameters, N_PARAMETERS * sizeof(double));
    for (int i = 0; SLIPS_IN_SPACE && i < N_UNILATERALS; i++) {
        if (contact_slips(i) == 2 && !contact_slides_in_space(state, i)) {
            directed[FIRST_DIRECTION + SLIP_ROWS[i] - FIRST_SLIP] = BEYOND_SLIPS;
        }
    }
}

void contacts_answer_adjoint(Instance *instance, double unknowns[], Seed *sensitivity) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_ZEROS(mark, double, weights, SIZE_FRICTIONAL);
    WORK(mark, double, rows, SIZE_FRICTIONAL);
    WORK_ZEROS(mark, double, of_forces, SIZE_FRICTIONAL);
    WORK(mark, double, of_unknowns, N_UNKNOWNS);
    WORK(mark, double, directed, N_PARAMETERS);
    WORK_OF(mark, Seed, term);
    WORK_OF(mark, Sliding, sliding);
    const State *state = &instance->state;
    memset(term, 0, sizeof *term);
    sliding_evaluate(instance, &instance->cache.system, state->time, state->states, state->inputs, sliding);
    for (int k = 0; k < sliding->count; k++) {
        for (int i = 0; i < N_UNKNOWNS; i++) {
            weights[k] += sliding->answer[k][i] * unknowns[i];
        }
    }
    if (sliding->count == 0 || !solve_transposed(instance, sliding, weights, rows)) {
        arena_release(mark);
        return;
    }
    for (int k = 0; k < sliding->count; k++) {
        of_forces[sliding->row[k] - FIRST_SLIP] = rows[k];
    }
    direct_all(state, directed);
    mechanism_friction_adjoint(state->time, state->states, state->inputs, directed, instance->cache.accelerations,
                               of_forces, &term->time, term->states, term->inputs, term->parameters, of_unknowns);
    seed_add(sensitivity, term);
    for (int i = 0; i < N_UNKNOWNS; i++) {
        unknowns[i] += of_unknowns[i];
    }
    arena_release(mark);
}
