/* Contacts in the plane and bounded rows as one linear complementarity problem. For a row of friction its x is the
   difference of two variables >= 0, one for each direction; a third one, the slip, is positive where they reach the
   limit: Stewart, Trinkle 1996. The matrix is copositive unless rows slide. */
#include "polyhedral.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

#include "lemke.h"
#include "scale.h"

/* More choices are not tried one by one when a solution is looked for. */
static const double MOST_CHOICES = 4096.0;

/* More choices are not tried one by one when another solution is looked for, which happens at each event. */
static const double MOST_OTHERS = 81.0;

/* A variable of the complementarity problem is: x of a row with a sign, or a slip (sign 0). */
typedef struct {
    int count;
    int *row;     /* [count], as the next ones */
    double *sign;
    int *slip;    /* of a direction: its slip variable, else -1 */
    int *first;   /* row -> its first variable */
} Layout;

/* How many variables the laws have. */
static int count_variables(const Laws *laws) {
    int count = 0;
    for (int k = 0; k < laws->size; k++) {
        const int width = laws->width[k];
        count += width == 0 ? 1 : width > 0 ? 2 * width + 1 : 0;
    }
    return count;
}

static void add(Layout *layout, int row, double sign, int slip) {
    const int v = layout->count++;
    layout->row[v] = row;
    layout->sign[v] = sign;
    layout->slip[v] = slip;
}

static void lay_out(const Laws *laws, int variables, Layout *layout) {
    const size_t count = (size_t)variables;
    layout->count = 0;
    layout->row = arena_take(laws->arena, count * sizeof(int));
    layout->sign = arena_take(laws->arena, count * sizeof(double));
    layout->slip = arena_take(laws->arena, count * sizeof(int));
    layout->first = arena_take(laws->arena, (size_t)laws->size * sizeof(int));
    for (int k = 0; k < laws->size; k++) {
        layout->first[k] = layout->count;
        const int width = laws->width[k];
        if (width == 0) {
            add(layout, k, 1.0, -1);
            continue;
        }
        const int slip = layout->count + 2 * width;
        for (int i = 0; i < width; i++) {
            layout->first[k + i] = layout->count;
            add(layout, k + i, 1.0, slip);
            add(layout, k + i, -1.0, slip);
        }
        add(layout, k, 0.0, -1);
        k += width - 1;
    }
}

/* The row of the slip: limit - the sum of both directions >= 0. */
static void fill_limit(const Laws *laws, const Layout *layout, int v, Lcp *lcp) {
    const int k = layout->row[v];
    double *entries = lcp->matrix + v * lcp->size;
    lcp->offset[v] = laws->base[k];
    for (int j = 0; j < lcp->size; j++) {
        entries[j] = layout->slip[j] == v ? -1.0 : 0.0;
    }
    if (laws->normal[k] >= 0) {
        entries[layout->first[laws->normal[k]]] = laws->slope[k];
    }
}

static void fill(const Laws *laws, const Layout *layout, Lcp *lcp) {
    lcp->size = layout->count;
    for (int v = 0; v < lcp->size; v++) {
        const int k = layout->row[v];
        if (layout->sign[v] == 0.0) {
            fill_limit(laws, layout, v, lcp);
            continue;
        }
        lcp->offset[v] = layout->sign[v] * laws->offset[k];
        for (int j = 0; j < lcp->size; j++) {
            const double entry = laws->matrix[k * laws->size + layout->row[j]];
            lcp->matrix[v * lcp->size + j] = layout->sign[v] * layout->sign[j] * entry;
        }
        if (layout->slip[v] >= 0) {
            lcp->matrix[v * lcp->size + layout->slip[v]] = 1.0;
        }
    }
}

/* x of a row of friction is its limit, on this side. */
static void put_limit(const Laws *laws, int k, double side, Choice *choice) {
    choice->value[k] = side * laws->base[k];
    choice->slope[k] = laws->normal[k] >= 0 ? side * laws->slope[k] : 0.0;
}

/* The equations of the variables that are positive. */
static void choose(const Laws *laws, const Layout *layout, const bool positive[], Choice *choice) {
    for (int k = 0; k < laws->size; k++) {
        const int v = layout->first[k];
        if (laws->width[k] == 0) {
            choice->held[k] = positive[v];
            continue;
        }
        const bool forward = positive[v], backward = positive[v + 1];
        const double side = (forward ? 1.0 : 0.0) - (backward ? 1.0 : 0.0);
        choice->held[k] = !positive[layout->slip[v]] || (forward && backward);
        put_limit(laws, k, side, choice);
    }
}

/* One equation after the other for each row, the last row turning fastest: open, held; held, backward, forward. False
   when all were had. */
static bool next_choice(const Laws *laws, int digit[]) {
    for (int k = laws->size - 1; k >= 0; k--) {
        digit[k] = (digit[k] + 1) % (laws->width[k] == 0 ? 2 : 3);
        if (digit[k] > 0) {
            return true;
        }
    }
    return false;
}

static double count_choices(const Laws *laws) {
    double choices = 1.0;
    for (int k = 0; k < laws->size; k++) {
        choices *= laws->width[k] == 0 ? 2.0 : 3.0;
    }
    return choices;
}

/* The first row whose accelerations differ, where these are `own` for the one and w of x for the other; -1: none. */
static int moved_row(const Laws *laws, const double own[], const double x[]) {
    const ArenaMark mark = arena_mark(laws->arena);
    double *w = arena_take(laws->arena, (size_t)laws->size * sizeof(double)), greatest = 0.0, terms = 0.0;
    int moved = -1;
    laws_evaluate(laws, x, w);
    for (int k = 0; k < laws->size; k++) {
        greatest = fmax(greatest, fmax(fabs(own[k]), fabs(w[k])));
        terms = fmax(terms, laws_terms(laws, x, k));
    }
    for (int k = laws->size - 1; k >= 0; k--) {
        moved = fabs(w[k] - own[k]) > fmax(LOCATED * greatest, TOLERATED * terms) ? k : moved;
    }
    arena_release(mark);
    return moved;
}

/* Tries all choices in turn; with accelerations that are known, those of another motion. */
static bool enumerate(const Laws *laws, const double known[], double x[]) {
    const ArenaMark mark = arena_mark(laws->arena);
    int *digit = arena_take(laws->arena, (size_t)laws->size * sizeof(int));
    bool solved = false;
    memset(digit, 0, (size_t)laws->size * sizeof(int));
    for (bool more = true; more && !solved; more = next_choice(laws, digit)) {
        const ArenaMark trial = arena_mark(laws->arena);
        Choice choice = choice_take(laws->arena, laws->size);
        for (int k = 0; k < laws->size; k++) {
            const bool unilateral = laws->width[k] == 0;
            const double side = digit[k] == 0 ? 0.0 : digit[k] == 1 ? -1.0 : 1.0;
            choice.held[k] = digit[k] == (unilateral ? 1 : 0);
            put_limit(laws, k, unilateral ? 0.0 : side, &choice);
        }
        memset(x, 0, (size_t)laws->size * sizeof(double));
        solved = laws_try(laws, &choice, x) && (known == NULL || moved_row(laws, known, x) >= 0);
        arena_release(trial);
    }
    return arena_leave(mark, solved);
}

int polyhedral_other(const Laws *laws, const double x[]) {
    const ArenaMark mark = arena_mark(laws->arena);
    double *other = arena_take(laws->arena, (size_t)laws->size * sizeof(double));
    double *own = arena_take(laws->arena, (size_t)laws->size * sizeof(double));
    laws_evaluate(laws, x, own);
    const bool found = count_choices(laws) <= MOST_OTHERS && enumerate(laws, own, other);
    const int moved = found ? moved_row(laws, own, other) : -1;
    arena_release(mark);
    return moved;
}

/* The memory of a complementarity problem of so many variables and of its solution. */
static bool reserve_polyhedron(Arena *arena, int variables) {
    const size_t n = (size_t)variables;
    return arena_reserve(arena, (2 * n * n + 8 * n + 32) * sizeof(double));
}

/* *solved: the x and the equations found solve the complementarity problem. False: there is no memory for it. */
static bool approximate(const Laws *laws, Choice *choice, double x[], bool *solved) {
    const ArenaMark mark = arena_mark(laws->arena);
    const int variables = count_variables(laws);
    const size_t size = (size_t)variables;
    memset(x, 0, (size_t)laws->size * sizeof(double));
    if (!reserve_polyhedron(laws->arena, variables)) {
        return false;
    }
    Layout layout;
    lay_out(laws, variables, &layout);
    double *z = arena_take(laws->arena, size * sizeof(double));
    bool *positive = arena_take(laws->arena, size * sizeof(bool));
    Lcp lcp = {.matrix = arena_take(laws->arena, size * size * sizeof(double)),
               .offset = arena_take(laws->arena, size * sizeof(double))};
    fill(laws, &layout, &lcp);
    *solved = lemke_solve(laws->arena, &lcp, z, positive);
    for (int v = 0; v < lcp.size; v++) {
        x[layout.row[v]] += layout.sign[v] * z[v];
    }
    choose(laws, &layout, positive, choice);
    return arena_leave(mark, true);
}

bool polyhedral_approximate(const Laws *laws, double x[]) {
    const ArenaMark mark = arena_mark(laws->arena);
    Choice choice = choice_take(laws->arena, laws->size);
    bool solved;
    return arena_leave(mark, approximate(laws, &choice, x, &solved));
}

bool polyhedral_solve(const Laws *laws, double x[]) {
    const ArenaMark mark = arena_mark(laws->arena);
    Choice choice = choice_take(laws->arena, laws->size);
    bool solved = false;
    if (!approximate(laws, &choice, x, &solved)) {
        return arena_leave(mark, false);
    }
    return arena_leave(mark, (solved && laws_try(laws, &choice, x)) ||
                                 (count_choices(laws) <= MOST_CHOICES && enumerate(laws, NULL, x)));
}
