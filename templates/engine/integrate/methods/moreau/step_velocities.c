#include "step_velocities.h"

#include <math.h>
#include <string.h>

#include "scale.h"
#include "step_impulses.h"

/* Bound of the projections; what is left then is left for the next step. */
enum { MOST_VELOCITY_CORRECTIONS = REAL_TIME ? 1 : 8 };

/* Does a permanent constraint move? */
static bool constraints_move(const SolverScratch *scratch) {
    bool moves = false;
    for (int row = 0; row < N_PERMANENT && !moves; row++) {
        moves = fabs(scratch->end.velocities[row]) > MET * scratch->pace * scratch->end.sizes[row];
    }
    return moves;
}

/* Moves qd[n] by what the velocities along the rows need; their residual is that of the rows in the middle. */
static void project_velocities(Instance *instance, double qd[], double *dissipated) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, pushes, K);
    WORK(mark, double, changes, N);
    WORK_ZEROS(mark, bool, permanent, K);
    SteppedRows *end = &instance->scratch.solver.end;
    memset(permanent, true, N_PERMANENT * sizeof(bool));
    choose_rows(&instance->scratch.solver, permanent);
    undo_chosen(instance, end->velocities, pushes, changes);
    for (int i = 0; i < N; i++) {
        qd[i] += changes[i];
    }
    for (int row = 0; row < N_PERMANENT; row++) {
        const double before = end->velocities[row];
        end->velocities[row] += stepped_along(end, row, changes);
        *dissipated -= 0.5 * pushes[row] * (before + end->velocities[row]);
    }
    arena_release(mark);
}

void step_velocities(Instance *instance, double states[]) {
    for (int i = 0; i < MOST_VELOCITY_CORRECTIONS && constraints_move(&instance->scratch.solver); i++) {
        project_velocities(instance, states + N, states + DISSIPATED);
    }
}
