/* A generalised Newton method for the equations that the laws choose: Alart, Curnier, A mixed formulation for
   frictional contact problems prone to Newton like solution methods, Comput. Methods Appl. Mech. Eng. 1991. What is
   held, open or slides, and how it turns, follows from x less a proximal step along w. */
#include "newton.h"

#include <math.h>
#include <string.h>

#include "newton_step.h"
#include "scale.h"
#include "vector_length.h"

/* The memory of the method. False: there is none. */
static bool begin_newton(const Laws *laws, double x[], Newton *newton) {
    Arena *arena = laws->arena;
    const size_t n = (size_t)laws->size, bytes = n * sizeof(double);
    const size_t work = laws->first == NULL ? (n + 8) * arena_bytes(bytes, 1) : 0; /* of least_norm_solve */
    if (!arena_reserve(arena, step_matrix_bytes(laws->size, laws->first) + work + 3 * arena_bytes(bytes, 1))) {
        return false;
    }
    *newton = (Newton){.laws = laws,
                       .equations = step_matrix_take(arena, laws->size, laws->first),
                       .right = (double *)arena_take(arena, bytes),
                       .change = (double *)arena_take(arena, bytes),
                       .x = x,
                       .w = (double *)arena_take(arena, bytes)};
    return true;
}

/* How much rounding goes on to change x. The force of a cone that slides has the direction of its slip, and the error
   of this direction is the rounding error of the slip over the slip. */
static double restlessness(const Newton *newton) {
    const Laws *laws = newton->laws;
    double greatest = 0.0;
    laws_evaluate(laws, newton->x, newton->w);
    for (int k = 0; k < laws->size; k++) {
        const double limit = laws->width[k] == 2 ? laws_limit(laws, newton->x, k) : 0.0;
        if (limit > 0.0 && vector_length(newton->x + k, 2) >= (1.0 - OBEYED) * limit) {
            const double slip = vector_length(newton->w + k, 2);
            greatest = fmax(greatest, limit * fmin(NOISE * laws_terms(laws, newton->x, k) / slip, OBEYED));
        }
    }
    return greatest;
}

/* Steps for few rows until they change x no more than rounding does. */
static bool refine(const Newton *newton) {
    double change = HUGE_VAL;
    bool moves = true;
    for (int count = 0; count < MOST_NEWTON_STEPS && moves; count++) {
        moves = !newton_step(newton);
        change = vector_greatest(newton->change, newton->laws->size);
        moves = moves || change > SOLVED * vector_greatest(newton->x, newton->laws->size);
    }
    return !moves || change <= restlessness(newton);
}

bool newton_solve(const Laws *laws, const double start[], double x[]) {
    static const double STEPS[] = {1.0, 10.0, 0.1, 100.0, 3.0, 30.0};
    const ArenaMark mark = arena_mark(laws->arena);
    Newton newton;
    bool solved = false;
    if (!begin_newton(laws, x, &newton)) {
        return arena_leave(mark, false);
    }
    const size_t ways = laws->first == NULL ? sizeof STEPS / sizeof *STEPS : 1;
    for (size_t i = 0; i < ways && !solved; i++) {
        memcpy(x, start, (size_t)laws->size * sizeof(double));
        newton.step = STEPS[i];
        solved = (laws->first == NULL ? refine(&newton) : newton_many(&newton)) && laws_obeyed(laws, x);
    }
    return arena_leave(mark, solved);
}
