/* Steps of ROS2 backwards (directed_ros2.c). With s = g h, A = I - s J, and a dash for the derivative by what is in
   front of it,

       m2 = A^-T h/2 x+',   y = f_x(x + h k1)^T m2,   m1 = A^-T (3 h/2 x+' - 2 m2 + h y),
       x' = x+' + y + f_x(x)^T m1 + s (m1^T d(J k1) + m2^T d(J k2)),

   and inputs and parameters get the same of f_p. */
#include <string.h>

#include "derivative.h"
#include "directed_ros2.h"
#include "ros2.h"
#include "tape.h"

void tape_begin_method(Tape *tape) {
    tape->method.none = 0;
}

/* Overwrites b[R] by the solution of M^T x = b, where lu_factorize has given the factors of M. */
static void lu_solve_back(Arena *arena, const SolverScratch *work, double b[]) {
    const ArenaMark mark = arena_mark(arena);
    WORK(mark, double, x, R);
    const double *a = work->matrix;
    for (int i = 0; i < R; i++) {
        double sum = b[i];
        for (int j = 0; j < i; j++) {
            sum -= a[j * R + i] * x[j];
        }
        x[i] = sum * a[i * R + i];
    }
    for (int i = R - 1; i >= 0; i--) {
        for (int j = i + 1; j < R; j++) {
            x[i] -= a[j * R + i] * x[j];
        }
    }
    for (int i = 0; i < R; i++) {
        b[work->rows[i]] = x[i];
    }
    arena_release(mark);
}

/* Overwrites m[N_STATES] by A^-T m: see ros2_solve, whose steps are transposed here. */
static void solve_back(Arena *arena, const SolverScratch *work, double h, double m[]) {
    const double s = GAMMA * h;
    for (int i = 0; i < N; i++) {
        m[N + i] += s * m[i];
    }
    lu_solve_back(arena, work, m + N);
    for (int j = 0; j < N; j++) {
        for (int i = 0; i < R; i++) {
            m[j] += s * work->jacobian[j * R + i] * m[N + i];
        }
    }
}

/* Adds f_x^T m at a time (s) and point to found[N_STATES]. */
static bool slope_back(Tape *tape, double time, const double point[], const double m[], double found[]) {
    Instance *instance = &tape->variations->study.instance;
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, slope, N_STATES);
    return arena_leave(mark, derivative_at(instance, time, point, slope) &&
                                 tape_slope_back(tape, time, point, slope, m, NULL, found));
}

/* Adds s m^T d(J k) to before[N_STATES]. */
static bool bend_back(Tape *tape, double h, const double k[], const double m[], double before[]) {
    Instance *instance = &tape->variations->study.instance;
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, states, N_STATES);
    WORK_ZEROS(mark, double, weighed, N_STATES);
    for (int i = 0; i < POINTS_BESIDE; i++) {
        const double weight = GAMMA * h * ros2_beside(instance, k, i, states);
        for (int j = N; j < N_STATES; j++) {
            weighed[j] = weight * m[j];
        }
        if (weight != 0.0 && !slope_back(tape, instance->state.time, states, weighed, before)) {
            return arena_leave(mark, false);
        }
    }
    return arena_leave(mark, true);
}

/* The stages of the step in scratch backwards: total are the derivatives by the states behind it, and then by those
   before it. */
static bool both_stages_back(Tape *tape, Step step, double total[]) {
    Instance *instance = &tape->variations->study.instance;
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_ZEROS(mark, double, m1, N_STATES);
    WORK_ZEROS(mark, double, m2, N_STATES);
    WORK_ZEROS(mark, double, found, N_STATES);
    const SolverScratch *work = &instance->scratch.solver;
    const double h = step.length;
    tape_add_weighted(m2, 0.5 * h, total);
    solve_back(instance->arena, work, h, m2);
    if (!slope_back(tape, step.end, instance->scratch.stage_states, m2, found)) {
        return arena_leave(mark, false);
    }
    tape_add_weighted(m1, 1.5 * h, total);
    tape_add_weighted(m1, -2.0, m2);
    tape_add_weighted(m1, h, found);
    solve_back(instance->arena, work, h, m1);
    tape_add_weighted(total, 1.0, found);
    return arena_leave(mark, slope_back(tape, instance->state.time, instance->state.states, m1, total) &&
                                 bend_back(tape, h, work->stages[0], m1, total) &&
                                 bend_back(tape, h, work->stages[1], m2, total));
}

bool tape_step_back(Tape *tape, const Entry *entry, const Checkpoint *checkpoint) {
    Instance *instance = &tape->variations->study.instance;
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, f2, N_STATES);
    State *state = &instance->state;
    double *total = tape->total.states;
    state->time = entry->time;
    memcpy(state->states, checkpoint->states, sizeof state->states);
    memcpy(state->first_stage, checkpoint->slope, sizeof state->first_stage);
    return arena_leave(
        mark, tape_project_back(tape, entry->step.end, checkpoint->unprojected, checkpoint->end_states, total) &&
                  ros2_stages(instance, entry->step, f2) && both_stages_back(tape, entry->step, total));
}
