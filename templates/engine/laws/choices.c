/* All choices of equations, one by one: the only way that finds each solution where sliding friction has several
   (Painleve's paradox). */
#include "choices.h"

#include <math.h>
#include <string.h>

#include "scale.h"
#include "shares.h"

/* The most choices that are tried one by one when another solution is looked for, which happens at each event: those of
   four rows of friction. */
static const double MOST_OTHERS = 81.0;

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

double choices_count(const Laws *laws) {
    double choices = 1.0;
    for (int k = 0; k < laws->size; k++) {
        choices *= laws->width[k] == 0 ? 2.0 : laws->width[k] == 1 ? 3.0 : HUGE_VAL;
    }
    return choices;
}

/* The first row whose accelerations differ, where these are `own` for the one and w of x for the other; -1: none. */
static int moved_row(const Laws *laws, const double own[], const double x[]) {
    const ArenaMark mark = arena_mark(laws->arena);
    double *w = (double *)arena_take(laws->arena, (size_t)laws->size * sizeof(double)), greatest = 0.0, terms = 0.0;
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

/* Does x stay a solution when rows share their loads by least norm? The room is that of shares_even and of x. */
static bool is_even(const Laws *laws, const double x[]) {
    const ArenaMark mark = arena_mark(laws->arena);
    double *other = (double *)arena_take(laws->arena, (size_t)laws->size * sizeof(double));
    return arena_leave(mark, shares_even(laws, laws, x, other));
}

/* x of a choice. Returns whether it obeys the laws. */
static bool try_digits(const Laws *laws, const int digit[], double x[]) {
    const ArenaMark mark = arena_mark(laws->arena);
    Choice choice = choice_take(laws->arena, laws->size);
    for (int k = 0; k < laws->size; k++) {
        const bool unilateral = laws->width[k] == 0;
        const double side = digit[k] == 0 ? 0.0 : digit[k] == 1 ? -1.0 : 1.0;
        choice.held[k] = digit[k] == (unilateral ? 1 : 0);
        choice_limit(laws, k, unilateral ? 0.0 : side, &choice);
    }
    memset(x, 0, (size_t)laws->size * sizeof(double));
    return arena_leave(mark, laws_try(laws, &choice, x));
}

bool choices_solve(const Laws *laws, const double known[], double x[]) {
    const ArenaMark mark = arena_mark(laws->arena);
    const size_t size = (size_t)laws->size, bytes = size * sizeof(double);
    bool solved = false, any = false;
    if (!arena_reserve(laws->arena, 2 * arena_bytes(size, bytes) + 23 * arena_bytes(bytes, 1))) {
        return arena_leave(mark, false);
    }
    int *digit = (int *)memset(arena_take(laws->arena, size * sizeof(int)), 0, size * sizeof(int));
    double *first = (double *)arena_take(laws->arena, bytes);
    for (bool more = true; more && !solved; more = next_choice(laws, digit)) {
        const bool obeys = try_digits(laws, digit, x);
        solved = obeys && (known == NULL ? is_even(laws, x) : moved_row(laws, known, x) >= 0);
        if (obeys && !any) {
            any = true;
            memcpy(first, x, bytes);
        }
    }
    if (any && !solved && known == NULL) {
        memcpy(x, first, bytes);
        solved = true;
    }
    return arena_leave(mark, solved);
}

int choices_other(const Laws *laws, const double x[]) {
    const ArenaMark mark = arena_mark(laws->arena);
    double *other = (double *)arena_take(laws->arena, (size_t)laws->size * sizeof(double));
    double *own = (double *)arena_take(laws->arena, (size_t)laws->size * sizeof(double));
    laws_evaluate(laws, x, own);
    const bool found = choices_count(laws) <= MOST_OTHERS && choices_solve(laws, own, other);
    const int moved = found ? moved_row(laws, own, other) : -1;
    arena_release(mark);
    return moved;
}
