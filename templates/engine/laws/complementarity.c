/* Eliminates what is linear, solves the laws that are left, spreads forces over redundant rows. */
#include "complementarity.h"

#include <math.h>
#include <string.h>

#include "cones.h"
#include "elimination.h"
#include "polyhedral.h"

/* The equations of the rows that hold at present. */
static void choose_present(const Elimination *e, Choice *choice) {
    for (int i = 0; i < e->active; i++) {
        choice->held[i] = e->problem->row[e->row[i]].holds;
    }
}

static bool in_space(const Laws *laws) {
    bool found = false;
    for (int k = 0; k < laws->size; k++) {
        found = found || laws->width[k] == 2;
    }
    return found;
}

static bool is_lone_contact(const Laws *laws) {
    return laws->size == 1 && laws->width[0] == 0;
}

/* A lone contact whose present mode breaks its law has one other mode only, which is tried. */
static bool turns(const Laws *laws, const Choice *present, double x[]) {
    if (!is_lone_contact(laws)) {
        return false;
    }
    bool held = false;
    double slope = 0.0, value = 0.0;
    Choice other = {&held, &slope, &value};
    other.held[0] = !present->held[0];
    x[0] = 0.0;
    return laws_try(laws, &other, x) && laws_bounded(laws, &other, x);
}

static bool solve_laws(const Elimination *e, const Laws *laws, double x[]) {
    const ArenaMark mark = arena_mark(laws->arena);
    Choice present = choice_take(laws->arena, laws->size);
    memset(x, 0, (size_t)laws->size * sizeof(double));
    choose_present(e, &present);
    const bool goes_on = laws_try(laws, &present, x) && laws_bounded(laws, &present, x);
    return arena_leave(mark, goes_on || turns(laws, &present, x) ||
                                 (in_space(laws) ? cones_solve(laws, x) : polyhedral_solve(laws, x)));
}

/* Rows of friction that slip fall from the greatest holding force to that of sliding; returns whether any did. */
static bool let_slip(const Elimination *e, const double x[], Laws *laws) {
    bool any = false;
    for (int i = 0; i < laws->size; i++) {
        const int pair = laws->width[i] == 2 ? 1 : 0;
        if (laws->width[i] <= 0 || (laws_at_rest(laws, x, i) && laws_at_rest(laws, x, i + pair))) {
            continue;
        }
        for (int k = i; k <= i + pair; k++) {
            const int row = e->row[k];
            const double base = laws->base[k], slope = laws->slope[k];
            set_limit(e, k, e->problem->row[row].friction, laws);
            any = any || laws->base[k] < base || laws->slope[k] < slope;
        }
    }
    return any;
}

/* Rows that stay at rest may share a load. Of all x with the same motion takes the one of least norm, if it obeys the
   laws. */
static void spread(const Laws *laws, double x[]) {
    if (is_lone_contact(laws)) {
        return; /* one row alone bears a unique load */
    }
    const ArenaMark mark = arena_mark(laws->arena);
    Choice choice = choice_take(laws->arena, laws->size);
    double *other = arena_take(laws->arena, (size_t)laws->size * sizeof(double));
    memset(other, 0, (size_t)laws->size * sizeof(double));
    for (int k = 0; k < laws->size; k++) {
        const double limit = laws_limit(laws, x, k), side = limit > 0.0 ? x[k] / limit : 0.0;
        choice.held[k] = laws_at_rest(laws, x, k);
        if (laws->width[k] != 0 && !choice.held[k]) {
            choice.slope[k] = laws->normal[k] >= 0 ? side * laws->slope[k] : 0.0;
            choice.value[k] = side * laws->base[k];
        }
    }
    if (laws_try(laws, &choice, other) && laws_bounded(laws, &choice, other)) {
        memcpy(x, other, (size_t)laws->size * sizeof(double));
    }
    arena_release(mark);
}

/* Eliminates what is linear and solves the laws that are left, for x[laws->size] of the arena. */
static bool reduce_and_solve(const Problem *problem, Elimination *elimination, Laws *laws, double **solution) {
    if (!eliminate_rows(problem, elimination, laws)) {
        return false;
    }
    double *x = arena_take(problem->arena, (size_t)laws->size * sizeof(double));
    *solution = x;
    for (int i = 0; i < laws->size; i++) {
        const int row = elimination->row[i];
        set_limit(elimination, i, problem->row[row].holding, laws);
    }
    do {
        if (!solve_laws(elimination, laws, x)) {
            return false;
        }
    } while (let_slip(elimination, x, laws));
    return true;
}

/* Does a row slide whose friction other rows answer? Else accelerations are unique. */
static bool any_slides(const Problem *problem) {
    bool found = false;
    for (int k = 0; k < problem->rows; k++) {
        found = found || (problem->row[k].law == ROW_SLIDING && problem->row[k].friction > 0.0);
    }
    return found;
}

int complementarity_other(const Problem *problem) {
    const ArenaMark mark = arena_mark(problem->arena);
    Elimination elimination;
    Laws laws;
    double *x;
    int other = -1;
    if (any_slides(problem) && reduce_and_solve(problem, &elimination, &laws, &x) && !in_space(&laws)) {
        other = polyhedral_other(&laws, x);
        other = other < 0 ? -1 : elimination.row[other];
    }
    arena_release(mark);
    return other;
}

static bool all_free(const Problem *problem) {
    bool free = true;
    for (int k = 0; k < problem->rows; k++) {
        free = free && problem->row[k].law == ROW_FREE;
    }
    return free;
}

bool complementarity_solve(const Problem *problem, double lambda[], double w[]) {
    const ArenaMark mark = arena_mark(problem->arena);
    Elimination elimination;
    Laws laws;
    double *x;
    if (problem->determined != NULL) {
        memset(problem->determined, 0, (size_t)problem->rows * sizeof(bool));
    }
    if (all_free(problem)) {
        memset(lambda, 0, (size_t)problem->rows * sizeof(double));
        memcpy(w, problem->free, (size_t)problem->rows * sizeof(double));
        return true;
    }
    if (!reduce_and_solve(problem, &elimination, &laws, &x)) {
        return arena_leave(mark, false);
    }
    spread(&laws, x);
    for (int i = 0; i < laws.size; i++) {
        x[i] = laws.width[i] == 0 ? fmax(x[i], 0.0) : x[i];
        if (problem->determined != NULL) {
            problem->determined[elimination.row[i]] = laws.width[i] != 0 && laws.determined[i];
        }
    }
    recover_rows(&elimination, x, lambda, w);
    return arena_leave(mark, true);
}
