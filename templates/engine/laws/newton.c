/* A generalised Newton method for the equations that the laws choose: Alart, Curnier, A mixed formulation for
   frictional contact problems prone to Newton like solution methods, Comput. Methods Appl. Mech. Eng. 1991. What is
   held, open or slides, and how it turns, follows from x less a proximal step along w. The steps are the same for both
   axes of a cone: the axes do not matter to the solution. */
#include "newton.h"

#include <math.h>
#include <string.h>

#include "step_matrix.h"
#include "least_norm.h"
#include "scale.h"
#include "sweeps.h"
#include "vector_length.h"

/* Bounds: of all steps; with many rows, of steps in turn that do not halve the residual, and the sweeps that follow
   each step there. */
enum { MOST_NEWTON_STEPS = 40, MOST_FAILURES = 4, SWEEPS_AFTER_A_STEP = 5 };

/* The steps differ in where they lead to from afar; the long ones serve where friction wedges. */
typedef struct {
    const Laws *laws;
    double step;    /* the proximal step of friction, in units of 1 / curvature */
    double damping; /* of rows that are held */
    StepMatrix equations;
    double *right;   /* [size] of the equations; the next ones [size] */
    double *change;  /* of x */
    double *x, *w;
    double *best;    /* x of the least residual */
} Newton;

/* Row k of the equations += factor times row `of` of the matrix. */
static void add_row(const Newton *newton, int k, int of, double factor) {
    const Sparse *matrix = &newton->laws->matrix;
    for (int e = matrix->start[of]; e < matrix->start[of + 1]; e++) {
        step_matrix_add(&newton->equations, k, matrix->column[e], factor * matrix->value[e]);
    }
}

/* Row k of the equations of a row or cone that sticks: w = 0, divided by the curvature, and damped: Yamashita,
   Fukushima, On the rate of convergence of the Levenberg-Marquardt method, Computing 15, 2001. */
static void put_held(const Newton *newton, int k) {
    const double rate = 1.0 / newton->laws->curvature[k];
    add_row(newton, k, k, rate);
    step_matrix_add(&newton->equations, k, k, newton->damping);
    newton->right[k] = -rate * newton->w[k];
}

/* Rows k and k + 1 of a cone that slides: x - limit u = 0 with the direction u of the trial x - rate w. A normal force
   that is negative on the way limits friction to 0 wherever it goes. */
static void put_cone(const Newton *newton, int k, double rate, const double trial[]) {
    const Laws *laws = newton->laws;
    const int width = laws->width[k], normal = laws->normal[k];
    const double length = vector_length(trial, 2), limit = laws_limit(laws, newton->x, k);
    for (int i = 0; i < width; i++) {
        const double u = trial[i] / length;
        newton->right[k + i] = limit * u - newton->x[k + i];
        step_matrix_add(&newton->equations, k + i, k + i, 1.0);
        if (normal >= 0 && newton->x[normal] >= 0.0) {
            step_matrix_add(&newton->equations, k + i, normal, -laws->slope[k] * u);
        }
        for (int j = 0; j < width; j++) {
            const double turn = limit / length * ((i == j ? 1.0 : 0.0) - u * trial[j] / length);
            step_matrix_add(&newton->equations, k + i, k + j, -turn);
            add_row(newton, k + i, k + j, turn * rate);
        }
    }
}

/* The linearised equations of one row or cone for the change of x. */
static void linearise(const Newton *newton, int k) {
    const Laws *laws = newton->laws;
    const int width = laws->width[k], rows = width > 0 ? width : 1;
    const double rate = (width > 0 ? newton->step : 1.0) / laws->curvature[k];
    double trial[2] = {0.0, 0.0};
    for (int i = 0; i < rows; i++) {
        trial[i] = newton->x[k + i] - rate * newton->w[k + i];
    }
    const double length = vector_length(trial, 2), limit = width > 0 ? laws_limit(laws, newton->x, k) : 0.0;
    const bool held = width == 0 ? trial[0] > 0.0 : length <= limit && limit > 0.0;
    if (!held && width > 0 && length > 0.0) {
        put_cone(newton, k, rate, trial);
        return;
    }
    for (int i = k; i < k + rows; i++) {
        if (held) {
            put_held(newton, i);
        } else {
            step_matrix_add(&newton->equations, i, i, 1.0); /* open: x = 0 */
            newton->right[i] = -newton->x[i];
        }
    }
}

/* The change of x, that of least norm for few rows. False: the equations are singular. */
static bool solve_equations(const Newton *newton) {
    const StepMatrix *equations = &newton->equations;
    if (equations->full != NULL) {
        least_norm_solve(newton->laws->arena, equations->size, equations->full, newton->right, newton->change);
        return true;
    }
    if (!step_matrix_factorize(equations, SOLVED)) {
        return false;
    }
    step_matrix_solve(equations, newton->right, newton->change);
    return true;
}

/* A step of Newton's method. False: the equations are singular. */
static bool step_on(const Newton *newton) {
    const Laws *laws = newton->laws;
    laws_evaluate(laws, newton->x, newton->w);
    step_matrix_clear(&newton->equations);
    for (int k = 0; k < laws->size; k++) {
        if (laws->width[k] >= 0) {
            linearise(newton, k);
        }
    }
    if (!solve_equations(newton)) {
        return false;
    }
    for (int k = 0; k < laws->size; k++) {
        newton->x[k] += newton->change[k];
    }
    return true;
}

/* The memory of the method. False: there is none. */
static bool begin_newton(const Laws *laws, double x[], Newton *newton) {
    Arena *arena = laws->arena;
    const size_t n = (size_t)laws->size, bytes = n * sizeof(double);
    const size_t work = laws->first == NULL ? (n + 8) * arena_bytes(bytes, 1) : 0; /* of least_norm_solve */
    if (!arena_reserve(arena, step_matrix_bytes(laws->size, laws->first) + work + 4 * arena_bytes(bytes, 1))) {
        return false;
    }
    *newton = (Newton){.laws = laws,
                       .equations = step_matrix_take(arena, laws->size, laws->first),
                       .right = (double *)arena_take(arena, bytes),
                       .change = (double *)arena_take(arena, bytes),
                       .x = x,
                       .w = (double *)arena_take(arena, bytes),
                       .best = (double *)arena_take(arena, bytes)};
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
        moves = !step_on(newton);
        change = vector_greatest(newton->change, newton->laws->size);
        moves = moves || change > SOLVED * vector_greatest(newton->x, newton->laws->size);
    }
    return !moves || change <= restlessness(newton);
}

/* Steps for many rows as long as they come nearer. Sweeps follow each that has not solved the laws, because they
   correct single contacts that the step wrongly took for open or closed. The first step is as long as Newton's: it
   solves what is linear, from wherever it begins. Then, far from the solution, the residual makes steps short. */
static bool refine_many(Newton *newton) {
    const Laws *laws = newton->laws;
    const size_t bytes = (size_t)laws->size * sizeof(double);
    double moved, least = sweeps_residual(laws, newton->x, newton->w, &moved);
    memcpy(newton->best, newton->x, bytes);
    int failures = 0;
    for (int i = 0; i < MOST_NEWTON_STEPS && failures < MOST_FAILURES && least > SOLVED; i++) {
        newton->damping = i == 0 ? DAMPING : fmax(fmin(moved, 1.0), DAMPING);
        if (!step_on(newton)) {
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
            memcpy(newton->best, newton->x, bytes);
        }
    }
    memcpy(newton->x, newton->best, bytes);
    return least <= SOLVED;
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
        solved = (laws->first == NULL ? refine(&newton) : refine_many(&newton)) && laws_obeyed(laws, x);
    }
    return arena_leave(mark, solved);
}
