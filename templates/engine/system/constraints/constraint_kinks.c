/* Kinks of constraints that solver steps pass. Halving the line between two positions again and again, towards where
   the velocity residuals change most, makes a smooth change vanish, and leaves that of a kink as it is. */
#include <math.h>
#include <string.h>

#include "constraint_residuals.h"
#include "constraints.h"

/* Bound of the halvings: a smooth change is below the bar after some ten in most cases. */
enum { HALVINGS = 40 };

/* The growth of speeds in a step from which on the step is unstable: where it ends tells nothing of kinks. */
enum { UNSTABLE = 1000 };

/* A line between the positions of two states[2n]. */
typedef struct {
    double time; /* s */
    const double *inputs, *from, *to;
} Line;

/* The residuals of the velocities in `to` at a part of the line. */
static void evaluate_on(const Line *line, const Instance *instance, double part, Values *values) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, states, N_STATES);
    memcpy(states, line->to, N_STATES * sizeof(double));
    for (int i = 0; i < N; i++) {
        states[i] = line->from[i] + part * (line->to[i] - line->from[i]);
    }
    residuals_evaluate(instance, line->time, states, line->inputs, values);
    arena_release(mark);
}

static double change_of(const Instance *instance, const Values *low, const Values *high, double unit) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_OF(mark, Values, change);
    *change = *high;
    for (int k = 0; k < N_CONSTRAINTS; k++) {
        change->velocities[k] -= low->velocities[k];
    }
    const double size = residual_size(change, VELOCITIES, unit, NULL);
    arena_release(mark);
    return size;
}

bool constraints_jump(const Instance *instance, double time, const double inputs[], const double from[],
                      const double to[], double bar) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_OF(mark, Values, low);
    WORK_OF(mark, Values, middle);
    WORK_OF(mark, Values, high);
    const Line line = {time, inputs, from, to};
    const double unit = residual_unit(VELOCITIES, to);
    const bool unstable = unit > (double)UNSTABLE * residual_unit(VELOCITIES, from);
    double part = 0.0, width = 1.0, size = unstable ? 0.0 : HUGE_VAL;
    evaluate_on(&line, instance, 0.0, low);
    evaluate_on(&line, instance, 1.0, high);
    for (int i = 0; i < HALVINGS && size > bar; i++) {
        width *= 0.5;
        evaluate_on(&line, instance, part + width, middle);
        const double below = change_of(instance, low, middle, unit);
        const double above = change_of(instance, middle, high, unit);
        if (below > above) {
            *high = *middle;
        } else {
            *low = *middle;
            part += width;
        }
        size = fmax(below, above);
    }
    return arena_leave(mark, size > bar);
}
