/* Steps of Radau IIA backwards. The step solves A = f(X(x, A), p) for the accelerations A at its stages and gives x+ =
   X_s(x, A) (radau.c, directed_radau.c). With a dash for the derivative by what is in front of it

       (I - f_x X_A)^T m = (X_s)_A^T x+',   x' = (X_s)_x^T x+' + (f_x X_x)^T m,   p' += f_p^T m.

   Hager, Runge-Kutta methods in optimal control and the transformed adjoint system, Numer. Math. 87, 2000. */
#include <string.h>

#include "collocation.h"
#include "derivative.h"
#include "directed_radau.h"
#include "lu.h"
#include "radau_stages.h"
#include "tape.h"

void tape_begin_method(Tape *tape) {
    tape->method.none = 0;
}

/* Stage i backwards: the derivatives by the states before the step are added to before[N_STATES]. */
static bool stage_back(Tape *tape, Step step, int i, const double accelerations[], const double weights[],
                       double before[]) {
    Instance *instance = &tape->variations->study.instance;
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, states, N_STATES);
    WORK(mark, double, slope, N_STATES);
    WORK_ZEROS(mark, double, of_slope, N_STATES);
    WORK_ZEROS(mark, double, found, N_STATES);
    const double time = radau_stage_time(instance, step, i);
    radau_stage(instance->state.states, step.length, i, accelerations, states);
    memcpy(of_slope + N, weights + i * R, R * sizeof(double));
    if (!derivative_at(instance, time, states, slope) ||
        !tape_slope_back(tape, time, states, slope, of_slope, NULL, found)) {
        return arena_leave(mark, false);
    }
    tape_add_weighted(before, 1.0, found);
    for (int k = 0; k < N; k++) {
        before[N + k] += COLLOCATION.c[i] * step.length * found[k];
    }
    return arena_leave(mark, true);
}

bool tape_step_back(Tape *tape, const Entry *entry, const Checkpoint *checkpoint) {
    enum { SIZE_OF_STEP = (int)S * R };
    Variations *variations = tape->variations;
    Instance *instance = &variations->study.instance;
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, right, SIZE_OF_STEP);
    WORK(mark, double, weights, SIZE_OF_STEP);
    const double h = entry->step.length, *accelerations = checkpoint->record.accelerations;
    double *total = tape->total.states;
    instance->state.time = entry->time;
    memcpy(instance->state.states, checkpoint->states, sizeof checkpoint->states);
    if (!tape_project_back(tape, entry->step.end, checkpoint->unprojected, checkpoint->end_states, total) ||
        !radau_linearize(variations, entry->step, accelerations, true)) {
        return arena_leave(mark, false);
    }
    for (int j = 0; j < S; j++) {
        for (int k = 0; k < R; k++) {
            const double by_position = k < N ? MODES.squared[(S - 1) * S + j] * total[k] : 0.0;
            right[j * R + k] = h * (COLLOCATION.a[(S - 1) * S + j] * total[N + k] + h * by_position);
        }
    }
    lu_solve(variations->method.matrix, variations->method.rows, SIZE_OF_STEP, right, weights);
    for (int k = 0; k < N; k++) {
        total[N + k] += COLLOCATION.c[S - 1] * h * total[k];
    }
    for (int i = 0; i < S; i++) {
        if (!stage_back(tape, entry->step, i, accelerations, weights, total)) {
            return arena_leave(mark, false);
        }
    }
    return arena_leave(mark, true);
}
