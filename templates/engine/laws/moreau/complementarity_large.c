/* Islands in turn, as laws in scaled rows; sweeps lead Newton's method where nothing else does. */
#include "complementarity_large.h"

#include <math.h>
#include <string.h>

#include "cones.h"
#include "few_rows.h"
#include "islands.h"
#include "lone_rows.h"
#include "newton.h"
#include "scale.h"
#include "shares.h"
#include "sweeps.h"

/* Sweeps of the first round; each further round takes twice as many. */
enum { FIRST_SWEEPS = 8 };

/* The most rows of an island that is solved with full matrices, as the laws at located events are. The cost of full
   matrices grows with the third power of the rows. */
enum { FEW_ROWS = 48 };

/* The rounds of sweeps before an island of few rows tries a path of Coulomb's law (cones.h). Six rounds cost less than
   a path; a path leads to solutions that sweeps do not find. */
enum { ROUNDS_BEFORE_A_PATH = 6 };

/* Where rigid rows have no solution, each row gives way by a part of the motion that its own force makes. The part
   grows by the factor YIELD_MORE until there is a solution, and ends below YIELD_MOST: motions would show more. */
static const double YIELD_MORE = 10.0, YIELD_MOST = 0.05;

typedef struct {
    const SparseProblem *problem;
    RowOrder order;
    double *scale; /* [rows], of elimination.h */
} Large;

/* --- an island as laws */

/* Friction of row k, whose limit is in units of the problem. */
static void put_large_law(const Large *large, int begin, int k, Laws *laws) {
    const Row *row = &large->problem->row[k];
    const int i = large->order.place[k] - begin;
    const double *scale = large->scale;
    const bool second = row->law == ROW_TANGENTIAL && row->normal < k - 1;
    const bool pair = row->law == ROW_TANGENTIAL && k + 1 < large->problem->delassus.rows &&
                      large->problem->row[k + 1].law == ROW_TANGENTIAL &&
                      large->problem->row[k + 1].normal == row->normal;
    laws->determined[i] = false;
    laws->width[i] = row->law == ROW_UNILATERAL ? 0 : second ? -1 : pair ? 2 : 1;
    laws->normal[i] = row->law == ROW_TANGENTIAL ? large->order.place[row->normal] - begin : -1;
    laws->slope[i] = row->law == ROW_TANGENTIAL ? row->friction * scale[row->normal] / scale[k] : 0.0;
    laws->base[i] = row->law == ROW_BILATERAL ? HUGE_VAL : row->law == ROW_BOUNDED ? row->friction / scale[k] : 0.0;
}

/* The laws of the rows from place begin on to end, of the arena. False: there is no memory. */
static bool take_laws(const Large *large, int begin, int end, Laws *laws) {
    const SparseProblem *problem = large->problem;
    const Sparse *delassus = &problem->delassus;
    const int n = end - begin;
    int entries = 0;
    for (int i = begin; i < end; i++) {
        entries += delassus->start[large->order.row[i] + 1] - delassus->start[large->order.row[i]];
    }
    if (!arena_reserve(problem->arena,
                       laws_bytes((size_t)n, (size_t)entries) + arena_bytes((size_t)n, sizeof(int)))) {
        return false;
    }
    int *first = (int *)arena_take(problem->arena, (size_t)n * sizeof(int));
    const Sparse matrix = sparse_take(problem->arena, n, entries);
    entries = 0;
    for (int i = 0; i < n; i++) {
        const int k = large->order.row[begin + i];
        first[i] = large->order.first[begin + i] - begin;
        for (int e = delassus->start[k]; e < delassus->start[k + 1]; e++) {
            const int other = delassus->column[e];
            matrix.column[entries] = large->order.place[other] - begin;
            matrix.value[entries++] = large->scale[k] * delassus->value[e] * large->scale[other];
        }
        matrix.start[i + 1] = entries;
    }
    *laws = laws_take(problem->arena, matrix);
    laws->first = first;
    for (int i = 0; i < n; i++) {
        const int k = large->order.row[begin + i];
        put_large_law(large, begin, k, laws);
        laws->offset[i] = large->scale[k] * problem->free[k];
        laws->terms[i] = fabs(laws->offset[i]);
    }
    laws_curve(laws);
    return true;
}

/* --- solving */

/* Does a row of friction move that held at the start, or rub another way than there? *on: does a contact slide on? */
static bool slips_anew(const Large *large, int begin, const Laws *laws, const double start[], const double x[],
                       bool *on) {
    bool anew = false;
    *on = false;
    for (int k = 0; k < laws->size; k++) {
        const int width = laws->width[k];
        const bool held = large->problem->row[large->order.row[begin + k]].holds;
        if (!laws_slips(laws, x, k)) {
            continue;
        }
        const double along = x[k] * start[k] + (width == 2 ? x[k + 1] * start[k + 1] : 0.0);
        anew = anew || held || (laws_limit(laws, x, k) > 0.0 && !(along > 0.0));
        *on = *on || (!held && laws->normal[k] >= 0 && along > 0.0);
    }
    return anew;
}

static void add_to_diagonal(const Laws *laws, double part) {
    const Sparse *matrix = &laws->matrix;
    for (int k = 0; k < laws->size; k++) {
        for (int e = matrix->start[k]; e < matrix->start[k + 1]; e++) {
            matrix->value[e] += matrix->column[e] == k ? part : 0.0;
        }
    }
}

/* Rows that give way alike, by as little as leads to a solution. Laws of impact may have no other one nearby: the
   points of a body that is tilted a little cannot all rebound and stick. What gives way less is redundant. */
static bool solve_yielding(const Laws *laws, const double start[], double x[]) {
    bool solved = false;
    for (double part = YIELD_MORE * sqrt(REDUNDANT); part < YIELD_MOST && !solved; part *= YIELD_MORE) {
        add_to_diagonal(laws, part);
        solved = newton_solve(laws, start, x) || cones_rest(laws, x);
        add_to_diagonal(laws, -part);
    }
    return solved;
}

/* x[size] from the start[size]. */
static bool solve_laws_from(const Large *large, int begin, const Laws *laws, int most_rounds, const double start[],
                            double x[]) {
    const ArenaMark mark = arena_mark(laws->arena);
    const size_t bytes = (size_t)laws->size * sizeof(double);
    if (!arena_reserve(laws->arena, 2 * arena_bytes(bytes, 1))) {
        return arena_leave(mark, false);
    }
    double *swept = (double *)arena_take(laws->arena, bytes), *other = (double *)arena_take(laws->arena, bytes), moved;
    Laws full = *laws;
    full.first = laws->size <= FEW_ROWS ? NULL : laws->first;
    const int last = most_rounds < ROUNDS_BEFORE_A_PATH ? most_rounds : ROUNDS_BEFORE_A_PATH;
    bool solved = most_rounds > 0 && newton_solve(laws, start, x), on = false, stays;
    if (most_rounds > 0 && (!solved || slips_anew(large, begin, laws, start, x, &on)) && cones_rest(&full, other)) {
        slips_anew(large, begin, laws, start, other, &stays);
        if (!(on && stays)) {
            memcpy(x, other, bytes);
        }
        solved = true;
        if (full.first == NULL) {
            shares_spread(&full, x);
        }
    }
    memcpy(swept, start, bytes);
    for (int round = 0, sweeps = FIRST_SWEEPS; round < most_rounds && !solved; round++, sweeps *= 2) {
        solved = sweeps_descend(laws, sweeps, swept) && newton_solve(laws, swept, x);
        if (!solved && round + 1 == last && full.first == NULL) {
            const bool rigid = cones_slide(&full, x);
            solved = rigid || solve_yielding(&full, swept, x);
            *large->problem->yielding = *large->problem->yielding || (solved && !rigid);
        }
    }
    if (!solved && sweeps_descend(laws, 0, swept)) {
        memcpy(x, swept, bytes);
        solved = sweeps_residual(laws, x, other, &moved) <= TOLERATED;
    }
    return arena_leave(mark, solved);
}

static bool solve_few_rows(const SparseProblem *problem, int count, const int rows[], FewRows *few, double lambda[]) {
    FewRows here;
    here.known = false;
    return lone_rows(problem, count, rows, lambda) ||
           few_rows(problem, count, rows, few == NULL ? &here : few, lambda);
}

/* lambda of the rows from place begin on to end. */
static bool solve_places(const Large *large, int begin, int end, int most_rounds, double lambda[]) {
    Arena *arena = large->problem->arena;
    const ArenaMark mark = arena_mark(arena);
    const size_t bytes = (size_t)(end - begin) * sizeof(double);
    Laws laws;
    if (solve_few_rows(large->problem, end - begin, large->order.row + begin, NULL, lambda)) {
        return true;
    }
    if (!take_laws(large, begin, end, &laws) || !arena_reserve(arena, 2 * arena_bytes(bytes, 1))) {
        return arena_leave(mark, false);
    }
    double *start = (double *)arena_take(arena, bytes), *x = (double *)arena_take(arena, bytes);
    for (int i = begin; i < end; i++) {
        start[i - begin] = lambda[large->order.row[i]] / large->scale[large->order.row[i]];
    }
    const bool solved = solve_laws_from(large, begin, &laws, most_rounds, start, x);
    for (int i = begin; i < end; i++) {
        lambda[large->order.row[i]] = x[i - begin] * large->scale[large->order.row[i]];
    }
    return arena_leave(mark, solved);
}

static bool find_sparse_scales(Large *large) {
    const Sparse *delassus = &large->problem->delassus;
    const size_t bytes = (size_t)delassus->rows * sizeof(double);
    if (!arena_reserve(large->problem->arena, 2 * arena_bytes(bytes, 1))) {
        return false;
    }
    large->scale = (double *)arena_take(large->problem->arena, bytes);
    double *diagonal = (double *)arena_take(large->problem->arena, bytes);
    for (int k = 0; k < delassus->rows; k++) {
        diagonal[k] = 0.0;
        for (int e = delassus->start[k]; e < delassus->start[k + 1]; e++) {
            diagonal[k] += delassus->column[e] == k ? delassus->value[e] : 0.0;
        }
    }
    find_scales(delassus->rows, large->problem->row, diagonal, 1, large->scale);
    return true;
}

/* The island of a row among few rows, each of which has a bit. */
static unsigned island_of(const SparseProblem *problem, int row) {
    const Sparse *delassus = &problem->delassus;
    const unsigned all = (1U << delassus->rows) - 1U;
    unsigned found = 1U << row, before = 0U;
    while (found != before && found != all) {
        before = found;
        for (int k = 0; k < delassus->rows; k++) {
            unsigned group = 1U << k | (problem->row[k].law == ROW_TANGENTIAL ? 1U << problem->row[k].normal : 0U);
            for (int e = delassus->start[k]; e < delassus->start[k + 1]; e++) {
                group |= 1U << delassus->column[e];
            }
            found |= (found & group) != 0U ? group : 0U;
        }
    }
    return found;
}

/* Few rows need no order; if each acts on each, they are one island. False: they are too many, or an island is left
   whose laws ask for more. */
static bool solve_few_islands(const SparseProblem *problem, double lambda[]) {
    static const int ALL[MOST_FEW_ROWS] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
    const int rows = problem->delassus.rows;
    if (problem->delassus.start[rows] == rows * rows) {
        return rows <= MOST_FEW_ROWS && solve_few_rows(problem, rows, ALL, problem->few, lambda);
    }
    int island[MOST_FEW_ROWS];
    unsigned done = 0U;
    bool solved = rows <= MOST_FEW_ROWS;
    for (int k = 0; k < rows && solved; k++) {
        if ((done >> k & 1U) != 0U) {
            continue;
        }
        const unsigned found = island_of(problem, k);
        int count = 0;
        for (int i = k; i < rows; i++) {
            island[count] = i;
            count += (int)(found >> i & 1U);
        }
        solved = solve_few_rows(problem, count, island, count == rows ? problem->few : NULL, lambda);
        done |= found;
    }
    return solved;
}

/* All islands in turn, each in its order of elimination. */
static bool solve_islands(const SparseProblem *problem, int most_rounds, double lambda[]) {
    Large large = {.problem = problem};
    if (!rows_order(problem, &large.order) || !find_sparse_scales(&large)) {
        return false;
    }
    bool solved = true;
    for (int i = 0; i < large.order.islands; i++) {
        solved = solve_places(&large, large.order.island[i], large.order.island[i + 1], most_rounds, lambda) && solved;
    }
    return solved;
}

bool complementarity_large(const SparseProblem *problem, int most_rounds, double lambda[], double w[]) {
    const ArenaMark mark = arena_mark(problem->arena);
    const bool solved = solve_few_islands(problem, lambda) || solve_islands(problem, most_rounds, lambda);
    if (w != NULL) {
        sparse_multiply(&problem->delassus, lambda, w);
    }
    for (int k = 0; k < problem->delassus.rows && w != NULL; k++) {
        w[k] += problem->free[k];
    }
    return arena_leave(mark, solved);
}
