#include "shares.h"

#include <string.h>

#include "newton.h"
#include "scale.h"
#include "vector_length.h"

/* Bound of the turns in which loads and slips in space are found. */
enum { MOST_TURNS = 30 };

/* Do the rows of friction that rest with the forces x[size] rest with other[size], too? */
static bool rest_alike(const Laws *laws, const double x[], const double other[]) {
    bool alike = true;
    for (int k = 0; k < laws->size && alike; k++) {
        alike = laws->width[k] == 0 || !laws_at_rest(laws, x, k) || laws_at_rest(laws, other, k);
    }
    return alike;
}

/* The part of its limit that a row of friction which slips bears. A contact that bears nothing, to rounding, has none
   yet: it is against the slip. */
static double slipping_side(const Laws *laws, const double x[], const double w[], double rounding, int k) {
    const int first = laws->width[k] < 0 ? k - 1 : k, rows = laws->width[first];
    const double limit = laws_limit(laws, x, k), slip = vector_length(w + first, rows);
    const bool rubs = limit > rounding && vector_length(x + first, rows) > 0.5 * limit;
    return rubs ? x[k] / limit : slip > 0.0 ? -w[k] / slip : 0.0;
}

/* Rows of friction that are held beyond their limit bear no more than it. Returns whether there are any. */
static bool give_way(const Laws *laws, const double x[], Choice *choice) {
    bool any = false;
    for (int k = 0; k < laws->size; k++) {
        const int rows = laws->width[k];
        const double force = rows > 0 ? vector_length(x + k, rows) : 0.0;
        if (rows <= 0 || !choice->held[k] || force <= laws_limit(laws, x, k) + NOISE * laws_terms(laws, x, k)) {
            continue;
        }
        any = true;
        for (int i = k; i < k + rows; i++) {
            choice->held[i] = false;
            choice_limit(laws, i, x[i] / force, choice);
        }
    }
    return any;
}

bool shares_even(const Laws *laws, const Laws *found, const double x[], double other[]) {
    const ArenaMark mark = arena_mark(laws->arena);
    Choice choice = choice_take(laws->arena, laws->size);
    const size_t bytes = (size_t)laws->size * sizeof(double);
    double *w = (double *)arena_take(laws->arena, bytes);
    const double rounding = NOISE * vector_greatest(x, laws->size);
    laws_evaluate(laws, x, w);
    for (int k = 0; k < laws->size; k++) {
        choice.held[k] = laws_at_rest(laws, x, k);
        if (laws->width[k] != 0 && !choice.held[k]) {
            choice_limit(laws, k, slipping_side(found, x, w, rounding, k), &choice);
        }
    }
    bool obeyed, gives = false;
    do {
        memset(other, 0, bytes);
        obeyed = laws_try(laws, &choice, other);
        laws_clear_pulls(laws, NOISE * vector_greatest(other, laws->size), other);
        obeyed = obeyed && laws_bounded(laws, &choice, other) && (!gives || rest_alike(laws, x, other));
        gives = !obeyed && give_way(laws, other, &choice);
    } while (gives);
    return arena_leave(mark, obeyed);
}

/* Does a cone slip? */
static bool cone_slips(const Laws *laws, const double x[]) {
    bool found = false;
    for (int i = 0; i < laws->size && !found; i++) {
        found = laws->width[i] == 2 && laws_slips(laws, x, i);
    }
    return found;
}

/* Slips of cones turn with the loads that their friction follows. Under the limits of given loads they are those of a
   convex problem; from other[size] on, both are found in turn. Returns whether other[] obeys the laws at last. */
static bool share_in_turn(const Laws *laws, double other[]) {
    const ArenaMark mark = arena_mark(laws->arena);
    const size_t bytes = (size_t)laws->size * sizeof(double);
    bool shared = false, solved = true;
    Laws given = *laws;
    double *slips = (double *)arena_take(laws->arena, bytes);
    given.base = (double *)arena_take(laws->arena, bytes);
    given.slope = (double *)memset(arena_take(laws->arena, bytes), 0, bytes);
    for (int turn = 0; turn < MOST_TURNS && solved && !shared; turn++) {
        for (int k = 0; k < laws->size; k++) {
            given.base[k] = laws->width[k] != 0 ? laws_limit(laws, other, k) : 0.0;
        }
        solved = newton_solve(&given, other, slips);
        shared = solved && shares_even(laws, &given, slips, other);
    }
    return arena_leave(mark, shared);
}

void shares_spread(const Laws *laws, double x[]) {
    const ArenaMark mark = arena_mark(laws->arena);
    const size_t size = (size_t)laws->size, bytes = size * sizeof(double);
    if (!arena_reserve(laws->arena, 2 * arena_bytes(size, bytes) + 24 * arena_bytes(bytes, 1))) {
        arena_release(mark);
        return;
    }
    double *other = (double *)arena_take(laws->arena, bytes);
    if (shares_even(laws, laws, x, other) || (cone_slips(laws, x) && share_in_turn(laws, other))) {
        memcpy(x, other, bytes);
    }
    arena_release(mark);
}
