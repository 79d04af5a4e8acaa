#include "correction.h"

#include <string.h>

#include "solver.h"
#include "system.h"

/* sums[rows] += G vector. */
static void add_slopes(const double jacobian[], int rows, const double vector[], double sums[]) {
    for (int k = 0; k < rows; k++) {
        for (int i = 0; i < N; i++) {
            sums[k] += jacobian[k * N + i] * vector[i];
        }
    }
}

bool correction_find(Instance *instance, double time, const double inputs[], const double from[], const double to[],
                     Level level, Correction *correction) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_ZEROS(mark, double, below, N_CONSTRAINTS);
    static const double ZERO[N_COORDINATES] = {0.0};
    System *system = &instance->scratch.system;
    double *unknowns = correction->unknowns;
    correction->level = level;
    correction->moved = false;
    memset(unknowns, 0, sizeof correction->unknowns);
    for (int i = 0; i < N; i++) {
        const int place = level == POSITIONS ? i : N + i;
        unknowns[i] = to[place] - from[place];
        correction->moved = correction->moved || (METHOD.error_order == 0 && unknowns[i] != 0.0);
    }
    correction->at = correction->moved && correction_keeps(level) ? from : to;
    if (!system_factorize(instance, time, correction->at, inputs, rows_of(level), 0.0, system)) {
        return arena_leave(mark, false);
    }
    if (correction->moved) {
        add_slopes(system->constraints.jacobian, rows_of(level), unknowns, below);
        system_solve(system, ZERO, below, NULL, unknowns);
        residuals_evaluate(instance, time, to, inputs, &correction->values);
    }
    return arena_leave(mark, true);
}

void correction_answer(const System *system, const Correction *correction, const double c[], const double rows[],
                       double change[]) {
    const ArenaMark mark = arena_mark(system->arena);
    WORK_ZEROS(mark, double, right, N_COORDINATES);
    WORK(mark, double, below, N_CONSTRAINTS);
    WORK(mark, double, answer, N_UNKNOWNS);
    const int count = rows_of(correction->level);
    for (int i = 0; i < N; i++) {
        right[i] = -c[i];
        change[i] = 0.0;
    }
    for (int solution = 0; solution < correction_solutions(correction); solution++) {
        memcpy(below, rows, (size_t)count * sizeof(double));
        if (solution > 0) {
            add_slopes(correction->values.jacobian, count, change, below);
            memset(right, 0, N_COORDINATES * sizeof(double));
        }
        for (int k = 0; k < count; k++) {
            below[k] = -below[k];
        }
        system_solve(system, right, below, NULL, answer);
        for (int i = 0; i < N; i++) {
            change[i] += answer[i];
        }
    }
    arena_release(mark);
}
