/* Eliminates what is linear, solves the laws that are left, spreads forces over redundant rows. */
#include "complementarity.h"

#include <math.h>
#include <string.h>

#include "choices.h"
#include "cones.h"
#include "elimination.h"
#include "scale.h"
#include "shares.h"

/* The equations of the rows that hold at present. */
static void choose_present(const Elimination *e, Choice *choice) {
    for (int i = 0; i < e->active; i++) {
        choice->held[i] = e->problem->row[e->row[i]].holds;
    }
}

static bool is_lone_contact(const Laws *laws) {
    return laws->size == 1 && laws->width[0] == 0;
}

/* Does a choice of equations lead to x[size] that obeys all laws, and its own limits exactly? */
static bool choice_solves(const Laws *laws, const Choice *choice, double x[]) {
    memset(x, 0, (size_t)laws->size * sizeof(double));
    return laws_try(laws, choice, x) && laws_bounded(laws, choice, x);
}

/* A lone contact whose present mode breaks its law has one other mode only, which is tried. */
static bool solve_laws(const Elimination *e, const Laws *laws, double x[]) {
    const ArenaMark mark = arena_mark(laws->arena);
    Choice choice = choice_take(laws->arena, laws->size);
    choose_present(e, &choice);
    bool solved = choice_solves(laws, &choice, x);
    if (!solved && is_lone_contact(laws)) {
        choice.held[0] = !choice.held[0];
        solved = choice_solves(laws, &choice, x);
    }
    return arena_leave(mark, solved || cones_solve(laws, x));
}

/* Does a row slip that holds at present, and not only from now on? */
static bool breaks_loose(const Elimination *e, const Laws *laws, const double x[]) {
    bool found = false;
    for (int i = 0; i < laws->size && !found; i++) {
        const Row *row = &e->problem->row[e->row[i]];
        found = row->holds && !row->slid && laws_slips(laws, x, i);
    }
    return found;
}

/* Sets the limits of rows that come to hold only now: as they slide, or as the most that they hold. Returns whether
   they differ. */
static bool limit_slid(const Elimination *e, bool sliding, Laws *laws) {
    bool differ = false;
    for (int i = 0; i < laws->size; i++) {
        const Row *row = &e->problem->row[e->row[i]];
        if (laws->width[i] != 0 && row->slid && row->holding > row->friction) {
            set_limit(e, i, sliding ? row->friction : row->holding, laws);
            differ = true;
        }
    }
    return differ;
}

/* Where a row breaks loose, the reason may be that rows which come to rest here bear their greatest holding force. They
   never exert this force if their slip only turns round. If all rows that hold can go on to hold while these exert
   their sliding friction, x becomes that solution. */
static void spare_holding(const Elimination *e, Laws *laws, double x[]) {
    const ArenaMark mark = arena_mark(laws->arena);
    const size_t bytes = (size_t)laws->size * sizeof(double);
    if (!breaks_loose(e, laws, x) || !limit_slid(e, true, laws)) {
        arena_release(mark);
        return;
    }
    double *other = (double *)arena_take(laws->arena, bytes);
    if (solve_laws(e, laws, other) && !breaks_loose(e, laws, other)) {
        memcpy(x, other, bytes);
    } else {
        limit_slid(e, false, laws);
    }
    arena_release(mark);
}

/* Rows of friction that slip fall from the greatest holding force to that of sliding; returns whether any did. */
static bool let_slip(const Elimination *e, const double x[], Laws *laws) {
    bool any = false;
    for (int i = 0; i < laws->size; i++) {
        if (!laws_slips(laws, x, i)) {
            continue;
        }
        const int pair = laws->width[i] == 2 ? 1 : 0;
        for (int k = i; k <= i + pair; k++) {
            const int row = e->row[k];
            const double base = laws->base[k], slope = laws->slope[k];
            set_limit(e, k, e->problem->row[row].friction, laws);
            any = any || laws->base[k] < base || laws->slope[k] < slope;
        }
    }
    return any;
}

/* Eliminates what is linear and solves the laws that are left, for x[laws->size] of the arena. */
static bool reduce_and_solve(const Problem *problem, const Islands *islands, int which, Elimination *elimination,
                             Laws *laws, double **solution) {
    if (!eliminate_rows(problem, islands, which, elimination, laws)) {
        return false;
    }
    double *x = (double *)arena_take(problem->arena, (size_t)laws->size * sizeof(double));
    *solution = x;
    for (int i = 0; i < laws->size; i++) {
        const int row = elimination->row[i];
        set_limit(elimination, i, problem->row[row].holding, laws);
    }
    bool solved = solve_laws(elimination, laws, x);
    if (solved) {
        spare_holding(elimination, laws, x);
    }
    while (solved && let_slip(elimination, x, laws)) {
        solved = solve_laws(elimination, laws, x);
    }
    return solved;
}

/* Does a row of the island slide whose friction other rows answer, or has an impact caught one, so that it comes to
   hold only now? Else accelerations are unique. */
static bool any_row(const Problem *problem, const Islands *islands, int which, bool slides) {
    bool found = false;
    for (int k = 0; k < problem->rows; k++) {
        const Row *row = &problem->row[k];
        const bool meant = slides ? row->law == ROW_SLIDING && row->friction > 0.0
                                  : row->law == ROW_TANGENTIAL && row->holds && row->slid;
        found = found || (islands->island[k] == which && meant);
    }
    return found;
}

/* Does x[size] bear on contacts, though all of them may open as well? Returns the first one that bears, or -1. */
static int wedged_row(const Laws *laws, const double x[]) {
    const ArenaMark mark = arena_mark(laws->arena);
    const size_t bytes = (size_t)laws->size * sizeof(double);
    int wedged = -1;
    for (int k = laws->size - 1; k >= 0; k--) {
        wedged = laws->width[k] == 0 && x[k] > 0.0 ? k : wedged;
    }
    const double *nothing = (const double *)memset(arena_take(laws->arena, bytes), 0, bytes);
    wedged = laws_obeyed(laws, nothing) ? wedged : -1;
    arena_release(mark);
    return wedged;
}

int complementarity_other(const Problem *problem) {
    const ArenaMark mark = arena_mark(problem->arena);
    Islands islands;
    int other = -1;
    if (!islands_find(problem, &islands)) {
        arena_release(mark);
        return -1;
    }
    for (int i = 0; i < islands.count && other < 0; i++) {
        const ArenaMark between = arena_mark(problem->arena);
        Elimination elimination;
        Laws laws;
        double *x;
        const bool slides = any_row(problem, &islands, i, true);
        if ((slides || any_row(problem, &islands, i, false)) &&
            reduce_and_solve(problem, &islands, i, &elimination, &laws, &x)) {
            const int moved = slides ? choices_other(&laws, x) : wedged_row(&laws, x);
            other = moved < 0 ? -1 : elimination.row[moved];
        }
        arena_release(between);
    }
    arena_release(mark);
    return other;
}

/* Sets lambda of one island. */
static bool solve_island(const Problem *problem, const Islands *islands, int which, double lambda[]) {
    const ArenaMark mark = arena_mark(problem->arena);
    Elimination elimination;
    Laws laws;
    double *x;
    if (!reduce_and_solve(problem, islands, which, &elimination, &laws, &x)) {
        return arena_leave(mark, false);
    }
    if (!is_lone_contact(&laws)) { /* one row alone bears a unique load */
        shares_spread(&laws, x);
    }
    laws_clear_pulls(&laws, HUGE_VAL, x);
    for (int i = 0; i < laws.size && problem->determined != NULL; i++) {
        problem->determined[elimination.row[i]] = laws.width[i] != 0 && laws.determined[i];
    }
    recover_rows(&elimination, x, lambda);
    return arena_leave(mark, true);
}

/* Is this one of the two rows of a contact that slips in space? */
static bool in_space(const Problem *problem, int k) {
    int rows = 0;
    for (int i = k > 0 ? k - 1 : 0; i <= k + 1 && i < problem->rows; i++) {
        rows += problem->row[i].law == ROW_TANGENTIAL && problem->row[i].normal == problem->row[k].normal;
    }
    return rows > 1;
}

/* Is the friction of row k, along a line, inside of its limit? Then it holds. */
static bool holds_inside(const Problem *problem, const double lambda[], int k) {
    const Row *row = &problem->row[k];
    const bool rubs = row->law == ROW_BOUNDED || (row->law == ROW_TANGENTIAL && !in_space(problem, k));
    const double limit = row->friction * (row->law == ROW_TANGENTIAL ? lambda[row->normal] : 1.0);
    return rubs && fabs(lambda[k]) < (1.0 - OBEYED) * limit;
}

/* w = free + delassus lambda. An entry becomes 0 where it is no more than rounding: of the terms of its own row, or of
   the greatest terms of all rows, which were solved together. Where friction holds, it is more than that along a motion
   on which the rows that hold have hardly a lever, as feet of a chain that lies almost straight. */
static bool evaluate_rows(const Problem *problem, const double scale[], const double lambda[], double w[]) {
    const ArenaMark mark = arena_mark(problem->arena);
    const int n = problem->rows;
    const size_t bytes = (size_t)n * sizeof(double);
    double greatest = 0.0;
    if (!arena_reserve(problem->arena, 2 * arena_bytes(bytes, 1))) {
        return false;
    }
    double *terms = (double *)arena_take(problem->arena, bytes);
    int *acts = (int *)arena_take(problem->arena, (size_t)n * sizeof(int)), count = 0;
    for (int k = 0; k < n; k++) {
        acts[count] = k;
        count += lambda[k] != 0.0;
    }
    for (int i = 0; i < n; i++) {
        terms[i] = fabs(problem->free[i]);
        w[i] = problem->free[i];
        for (int a = 0; a < count; a++) {
            const double part = problem->delassus[i * n + acts[a]] * lambda[acts[a]];
            terms[i] += fabs(part);
            w[i] += part;
        }
        greatest = fmax(greatest, scale[i] * terms[i]);
    }
    for (int i = 0; i < n; i++) {
        const double part = holds_inside(problem, lambda, i) ? TOLERATED : SOLVED;
        const double rounding = part * terms[i] + NOISE * greatest / scale[i];
        w[i] = fabs(w[i]) > rounding ? w[i] : 0.0;
    }
    return arena_leave(mark, true);
}

bool complementarity_solve(const Problem *problem, double lambda[], double w[]) {
    const ArenaMark mark = arena_mark(problem->arena);
    const size_t rows = (size_t)problem->rows;
    Islands islands;
    if (problem->determined != NULL) {
        memset(problem->determined, 0, rows * sizeof(bool));
    }
    memset(lambda, 0, rows * sizeof(double));
    if (!islands_find(problem, &islands)) {
        return arena_leave(mark, false);
    }
    if (islands.count == 0) {
        memcpy(w, problem->free, rows * sizeof(double));
        return arena_leave(mark, true);
    }
    bool solved = true;
    for (int i = 0; i < islands.count && solved; i++) {
        solved = solve_island(problem, &islands, i, lambda);
    }
    return arena_leave(mark, solved && evaluate_rows(problem, islands.scale, lambda, w));
}
