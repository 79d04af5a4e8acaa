/* Accelerated Gauss-Seidel sweeps and Newton's method in turn until the projected equations hold. */
#include "complementarity_large.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "envelope.h"
#include "scale.h"
#include "vector_length.h"

/* Newton's method ends when MOST_FAILURES steps in turn have not halved the residual. Sweeps follow each of its steps,
   because they correct single contacts that the step wrongly took for open or closed. */
enum { FIRST_SWEEPS = 8, MOST_LARGE_STEPS = 60, MOST_FAILURES = 4, SWEEPS_AFTER_A_STEP = 5 };

/* Greater forces for a free motion of 1 mean that there is no solution. */
static const double MOST_GROWTH_OF_FORCES = 1e10;

typedef struct {
    const SparseProblem *problem;
    Units units;
    Envelope envelope;
    double *x;
    double *w;
    double *curvature; /* [rows]: bound of the eigenvalues of the unit's normal or tangential block */
    double *swept;  /* x after the sweeps */
    double *best;   /* x of the least residual */
    double *right;  /* of Newton's equations; while sweeping the direction of the gradients' method */
    double damping;
} Large;

static double entry_of(const SparseProblem *problem, int i, int j) {
    double found = 0.0;
    for (int e = problem->start[i]; e < problem->start[i + 1]; e++) {
        found = problem->column[e] == j ? problem->value[e] : found;
    }
    return found;
}

/* How many rows of friction belong to the vector that begins with row k of a unit, 0 if none does. */
static int slips_from(const Large *large, int k) {
    const Row *row = &large->problem->row[k];
    if (row->law == ROW_BOUNDED) {
        return 1;
    }
    const bool begins = row->law == ROW_TANGENTIAL && (k == large->units.start[large->units.unit[k]] ||
                                                       large->problem->row[k - 1].law != ROW_TANGENTIAL);
    return begins ? large->units.start[large->units.unit[k] + 1] - k : 0;
}

static void find_curvature(Large *large) {
    const SparseProblem *problem = large->problem;
    for (int k = 0; k < problem->rows; k++) {
        const double a = entry_of(problem, k, k);
        if (slips_from(large, k) == 2) {
            const double b = entry_of(problem, k, k + 1), c = entry_of(problem, k + 1, k + 1);
            large->curvature[k] = 0.5 * (a + c + sqrt((a - c) * (a - c) + 4.0 * b * b));
            large->curvature[k + 1] = large->curvature[k];
        } else if (k == 0 || slips_from(large, k - 1) != 2) {
            large->curvature[k] = a;
        }
        large->curvature[k] = large->curvature[k] > 0.0 ? large->curvature[k] : 1.0;
    }
}

static void evaluate_large(Large *large) {
    const SparseProblem *problem = large->problem;
    for (int k = 0; k < problem->rows; k++) {
        large->w[k] = problem->free[k];
        for (int e = problem->start[k]; e < problem->start[k + 1]; e++) {
            large->w[k] += problem->value[e] * large->x[problem->column[e]];
        }
    }
}

static double limit_of(const Large *large, int k) {
    const Row *row = &large->problem->row[k];
    return row->friction * (row->law == ROW_BOUNDED ? 1.0 : fmax(large->x[row->normal], 0.0));
}

/* trial[count] = x - w / curvature, of which the law takes the nearest point it allows. */
static void find_trial(const Large *large, int k, int count, double trial[]) {
    for (int i = 0; i < count; i++) {
        trial[i] = large->x[k + i] - large->w[k + i] / large->curvature[k + i];
    }
}

/* The nearest point that the law of row k allows, for the rows of its vector; returns how many these are. */
static int project_large(const Large *large, int k, double to[]) {
    const Row *row = &large->problem->row[k];
    const int slips = slips_from(large, k);
    find_trial(large, k, slips == 2 ? 2 : 1, to);
    if (slips > 0) {
        const double length = vector_length(to, slips), limit = limit_of(large, k);
        for (int i = 0; i < slips && length > limit; i++) {
            to[i] *= limit / length;
        }
        return slips;
    }
    to[0] = row->law == ROW_BILATERAL ? to[0] : row->law == ROW_UNILATERAL ? fmax(to[0], 0.0) : 0.0;
    to[0] = row->law == ROW_GIVEN ? row->value : to[0];
    return 1;
}

static void sweep(Large *large) {
    const SparseProblem *problem = large->problem;
    double to[2];
    for (int k = 0, count = 1; k < problem->rows; k += count) {
        count = project_large(large, k, to);
        for (int i = k; i < k + count; i++) {
            const double change = to[i - k] - large->x[i];
            large->x[i] = to[i - k];
            for (int e = problem->start[i]; e < problem->start[i + 1] && change != 0.0; e++) {
                large->w[problem->column[e]] += problem->value[e] * change;
            }
        }
    }
}

/* Sweeps whose changes of x are taken for gradients of the method of Fletcher and Reeves: Silcowitz-Hansen, Niebe,
   Erleben, A nonsmooth nonlinear conjugate gradient method for interactive contact force problems, Visual Computer
   2010. */
static void descend(Large *large, int sweeps) {
    const int n = large->problem->rows;
    double *before = large->best, *direction = large->right;
    double last = INFINITY;
    memset(direction, 0, (size_t)n * sizeof(double));
    for (int s = 0; s < sweeps; s++) {
        double square = 0.0;
        memcpy(before, large->x, (size_t)n * sizeof(double));
        evaluate_large(large);
        sweep(large);
        for (int k = 0; k < n; k++) {
            const double change = large->x[k] - before[k];
            square += large->curvature[k] * change * change;
        }
        const double part = square <= last && last > 0.0 ? square / last : 0.0;
        for (int k = 0; k < n; k++) {
            const double change = large->x[k] - before[k];
            large->x[k] += part * direction[k];
            direction[k] = square <= last ? part * direction[k] + change : 0.0;
        }
        last = square;
    }
}

/* By how much the projection moves x beyond rounding errors, relative to what the greatest free motion does, each in
   units of its row. Relative to x it damps the next step of Newton's method. */
static double find_residual(Large *large) {
    double to[2], moved = 0.0, size = 0.0, usual = 0.0;
    evaluate_large(large);
    for (int k = 0, count = 1; k < large->problem->rows; k += count) {
        count = project_large(large, k, to);
        for (int i = k; i < k + count; i++) {
            const double unit = sqrt(large->curvature[i]);
            moved = fmax(moved, unit * fabs(to[i - k] - large->x[i]));
            size = fmax(size, unit * fabs(large->x[i]));
            usual = fmax(usual, fabs(large->problem->free[i]) / unit);
        }
    }
    large->damping = size > 0.0 ? fmin(moved / size, 1.0) : 1.0;
    const double rest = size > MOST_GROWTH_OF_FORCES * usual ? size : moved - NOISE * size;
    return rest > 0.0 ? rest / fmax(usual, DBL_MIN) : 0.0;
}

/* Row k of the equations += factor times row `of` of the Delassus operator. */
static void add_row(Large *large, int k, int of, double factor) {
    const SparseProblem *problem = large->problem;
    const int *place = large->units.place;
    for (int e = problem->start[of]; e < problem->start[of + 1]; e++) {
        *envelope_entry(&large->envelope, place[k], place[problem->column[e]]) += factor * problem->value[e];
    }
}

static void add_entry(Large *large, int k, int column, double value) {
    *envelope_entry(&large->envelope, large->units.place[k], large->units.place[column]) += value;
}

/* Friction that slides: x - limit u = 0 with the direction u of the trial. */
static void put_sliding(Large *large, int k, int count, const double trial[]) {
    const Row *row = &large->problem->row[k];
    const double length = vector_length(trial, count), limit = limit_of(large, k);
    for (int i = 0; i < count; i++) {
        const double u = length > 0.0 ? trial[i] / length : 0.0;
        large->right[large->units.place[k + i]] = limit * u - large->x[k + i];
        add_entry(large, k + i, k + i, 1.0);
        if (row->law == ROW_TANGENTIAL) {
            add_entry(large, k + i, row->normal, -row->friction * u);
        }
        for (int j = 0; j < count && length > 0.0; j++) {
            const double turn = limit / length * ((i == j ? 1.0 : 0.0) - u * trial[j] / length);
            add_entry(large, k + i, k + j, -turn);
            add_row(large, k + i, k + j, turn / large->curvature[k]);
        }
    }
}

/* The linearised equations of the vector that begins with row k; returns how many rows it has. */
static int put_equations(Large *large, int k) {
    const RowLaw law = large->problem->row[k].law;
    const int slips = slips_from(large, k), count = slips == 2 ? 2 : 1;
    double trial[2], to[2];
    find_trial(large, k, count, trial);
    project_large(large, k, to);
    const bool held = slips > 0 ? vector_length(trial, slips) <= limit_of(large, k) && limit_of(large, k) > 0.0
                                : law == ROW_BILATERAL || (law == ROW_UNILATERAL && trial[0] > 0.0);
    if (slips > 0 && !held) {
        put_sliding(large, k, slips, trial);
        return count;
    }
    for (int i = k; i < k + count; i++) {
        large->right[large->units.place[i]] = to[i - k] - large->x[i];
        /* far from the solution the residual's part makes steps short; near it they are those of Newton's method */
        add_entry(large, i, i, held ? fmax(large->damping, DAMPING) : 1.0);
        if (held) {
            add_row(large, i, i, 1.0 / large->curvature[i]);
        }
    }
    return count;
}

/* One step of Newton's method; false if its equations are singular. */
static bool newton_step(Large *large, int entries) {
    memset(large->envelope.lower, 0, (size_t)entries * sizeof(double));
    memset(large->envelope.upper, 0, (size_t)entries * sizeof(double));
    for (int k = 0; k < large->problem->rows;) {
        k += put_equations(large, k);
    }
    if (!envelope_factorize(&large->envelope, SOLVED)) {
        return false;
    }
    envelope_solve(&large->envelope, large->right);
    for (int k = 0; k < large->problem->rows; k++) {
        large->x[k] += large->right[large->units.place[k]];
    }
    return true;
}

/* Newton's method as long as it comes nearer; returns the least residual, of which best keeps x. */
static double refine(Large *large, int entries, double tolerance) {
    const size_t size = (size_t)large->problem->rows * sizeof(double);
    double residual = find_residual(large), least = residual;
    memcpy(large->best, large->x, size);
    for (int step = 0, failures = 0; step < MOST_LARGE_STEPS && failures < MOST_FAILURES && least > tolerance; step++) {
        if (!newton_step(large, entries)) {
            break;
        }
        evaluate_large(large);
        for (int s = 0; s < SWEEPS_AFTER_A_STEP; s++) {
            sweep(large);
        }
        residual = find_residual(large);
        failures = residual < 0.5 * least ? 0 : failures + 1;
        if (residual < least) {
            least = residual;
            memcpy(large->best, large->x, size);
        }
    }
    return least;
}

static void place_work(const LargeWork *work, Large *large) {
    const int n = large->problem->rows;
    int *integers = work->integers;
    double *numbers = work->numbers;
    large->units = (Units){0, integers, integers + n + 1, integers + 2 * n + 1, integers + 3 * n + 1,
                           integers + 4 * n + 1, integers + 5 * n + 1, integers + 6 * n + 1};
    large->curvature = numbers;
    large->swept = numbers + n;
    large->best = numbers + 2 * n;
    large->right = numbers + 3 * n;
    large->envelope = (Envelope){n, large->units.first, large->units.offset, numbers + 4 * n,
                                 numbers + 4 * n + work->capacity};
}

bool complementarity_large(const SparseProblem *problem, double tolerance, const LargeWork *work, double lambda[],
                           double w[], double *residual) {
    Large large;
    const size_t size = (size_t)problem->rows * sizeof(double);
    large.problem = problem;
    large.x = lambda;
    large.w = w;
    place_work(work, &large);
    const int entries = units_order(problem, &large.units);
    find_curvature(&large);
    *residual = find_residual(&large);
    for (int sweeps = FIRST_SWEEPS; sweeps <= work->most_sweeps && *residual > tolerance; sweeps *= 2) {
        descend(&large, sweeps);
        memcpy(large.swept, lambda, size);
        const double before = find_residual(&large);
        *residual = entries <= work->capacity ? refine(&large, entries, tolerance) : before;
        memcpy(lambda, *residual < before ? large.best : large.swept, size);
    }
    *residual = find_residual(&large);
    return *residual <= tolerance;
}

void complementarity_project(const SparseProblem *problem, const LargeWork *work, double lambda[], double w[]) {
    Large large;
    large.problem = problem;
    large.x = lambda;
    large.w = w;
    place_work(work, &large);
    units_order(problem, &large.units);
    find_curvature(&large);
    evaluate_large(&large);
    sweep(&large);
    evaluate_large(&large);
}
