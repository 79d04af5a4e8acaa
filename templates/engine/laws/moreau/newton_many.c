/* Newton's steps and sweeps in turn. */
#include <math.h>
#include <string.h>

#include "newton_step.h"
#include "scale.h"
#include "sweeps.h"

/* Bounds: of steps in turn that do not halve the residual, and of the sweeps that follow each step. */
enum { MOST_FAILURES = 4, SWEEPS_AFTER_A_STEP = 5 };

/* Steps go on as long as they come nearer. Sweeps follow each that has not solved the laws, because they correct single
   contacts that the step wrongly took for open or closed. The first step is as long as Newton's: it solves what is
   linear, from wherever it begins. Then, far from the solution, the residual makes steps short. */
bool newton_many(Newton *newton) {
    const Laws *laws = newton->laws;
    const ArenaMark mark = arena_mark(laws->arena);
    const size_t bytes = (size_t)laws->size * sizeof(double);
    if (!arena_reserve(laws->arena, arena_bytes(bytes, 1))) {
        return arena_leave(mark, false);
    }
    double *best = (double *)arena_take(laws->arena, bytes); /* x of the least residual */
    double moved, least = sweeps_residual(laws, newton->x, newton->w, &moved);
    memcpy(best, newton->x, bytes);
    int failures = 0;
    for (int i = 0; i < MOST_NEWTON_STEPS && failures < MOST_FAILURES && least > SOLVED; i++) {
        newton->damping = i == 0 ? DAMPING : fmax(fmin(moved, 1.0), DAMPING);
        if (!newton_step(newton)) {
            break;
        }
        double residual = sweeps_residual(laws, newton->x, newton->w, &moved);
        if (residual > SOLVED) {
            for (int s = 0; s < SWEEPS_AFTER_A_STEP; s++) {
                sweep(laws, newton->x, newton->w);
            }
            residual = sweeps_residual(laws, newton->x, newton->w, &moved);
        }
        failures = residual < 0.5 * least ? 0 : failures + 1;
        if (residual < least) {
            least = residual;
            memcpy(best, newton->x, bytes);
        }
    }
    memcpy(newton->x, best, bytes);
    return arena_leave(mark, least <= SOLVED);
}
