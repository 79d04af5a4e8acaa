/* Cholesky with diagonal pivoting for the bilateral rows: Golub, Van Loan, Matrix Computations, 4th edition, section
   4.2.8. The others see its Schur complement. */
#include "elimination.h"

#include <math.h>
#include <string.h>

#include "least_norm.h"
#include "scale.h"

static bool is_active(const Row *row) {
    return row->law == ROW_UNILATERAL || row->law == ROW_TANGENTIAL || row->law == ROW_BOUNDED;
}

static void scale_rows(Elimination *e) {
    const Problem *problem = e->problem;
    const int n = problem->rows;
    for (int a = 0; a < e->kept; a++) {
        const int i = e->row_kept[a];
        e->free[i] = e->scale[i] * problem->free[i];
        for (int b = 0; b < e->kept; b++) {
            const int j = e->row_kept[b];
            e->delassus[a * e->kept + b] = e->scale[i] * problem->delassus[i * n + j] * e->scale[j];
        }
    }
}

/* An entry of the scaled operator for two rows that are kept. */
static double reduced_entry(const Elimination *e, int row, int column) {
    return e->delassus[e->place_kept[row] * e->kept + e->place_kept[column]];
}

/* The remaining diagonal entry of the bilateral row at a place. */
static double rest_of(const Elimination *e, int place, int rank) {
    const int row = e->order[place];
    double rest = reduced_entry(e, row, row);
    for (int k = 0; k < rank; k++) {
        rest -= e->factor[place * e->bilateral + k] * e->factor[place * e->bilateral + k];
    }
    return rest;
}

static void exchange_places(Elimination *e, int a, int b) {
    const int row = e->order[a];
    e->order[a] = e->order[b];
    e->order[b] = row;
    for (int k = 0; k < e->bilateral; k++) {
        const double entry = e->factor[a * e->bilateral + k];
        e->factor[a * e->bilateral + k] = e->factor[b * e->bilateral + k];
        e->factor[b * e->bilateral + k] = entry;
    }
}

static void factorize_bilateral(Elimination *e) {
    const int m = e->bilateral;
    for (e->rank = 0; e->rank < e->bilateral; e->rank++) {
        const int k = e->rank;
        int best = k;
        for (int i = k + 1; i < e->bilateral; i++) {
            best = rest_of(e, i, k) > rest_of(e, best, k) ? i : best;
        }
        const double pivot = rest_of(e, best, k);
        if (!(pivot > REDUNDANT)) {
            return;
        }
        exchange_places(e, k, best);
        for (int i = k; i < e->bilateral; i++) {
            double entry = reduced_entry(e, e->order[i], e->order[k]);
            for (int j = 0; j < k; j++) {
                entry -= e->factor[i * m + j] * e->factor[k * m + j];
            }
            e->factor[i * m + k] = i == k ? sqrt(pivot) : entry / sqrt(pivot);
        }
    }
}

/* y[rank] = L^-1 of the bilateral entries of a column[rows]. */
static void solve_lower(const Elimination *e, const double column[], double y[]) {
    const int m = e->bilateral;
    for (int i = 0; i < e->rank; i++) {
        y[i] = column[e->order[i]];
        for (int k = 0; k < i; k++) {
            y[i] -= e->factor[i * m + k] * y[k];
        }
        y[i] /= e->factor[i * m + i];
    }
}

/* Adds w of all rows that are kept for lambda of one of them. */
static void add_column(const Elimination *e, int row, double lambda, double column[]) {
    for (int a = 0; a < e->kept; a++) {
        column[e->row_kept[a]] += e->delassus[a * e->kept + e->place_kept[row]] * lambda;
    }
}

/* lambda of a sliding row for lambda 1 of its normal, both scaled. */
static double drag(const Elimination *e, int row) {
    const Row *sliding = &e->problem->row[row];
    return -sliding->friction * sliding->value * e->scale[sliding->normal] / e->scale[row];
}

/* column[rows] = w of all rows that are kept, for lambda 1 of an active row and the friction that this makes where rows
   slide. */
static void column_of(const Elimination *e, int row, double column[]) {
    for (int a = 0; a < e->kept; a++) {
        column[e->row_kept[a]] = 0.0;
    }
    add_column(e, row, 1.0, column);
    for (int a = 0; a < e->kept; a++) {
        const int k = e->row_kept[a];
        if (e->problem->row[k].law == ROW_SLIDING && e->problem->row[k].normal == row) {
            add_column(e, k, drag(e, k), column);
        }
    }
}

/* The part of lambda of a row that is known beforehand, scaled. */
static double given(const Elimination *e, int row) {
    const Row *it = &e->problem->row[row];
    const Row *normal = &e->problem->row[it->law == ROW_SLIDING ? it->normal : row];
    const bool known = normal->law == ROW_GIVEN || normal->law == ROW_UNILATERAL;
    const double value = known ? normal->value / e->scale[normal - e->problem->row] : 0.0;
    return it->law == ROW_SLIDING ? drag(e, row) * value : value;
}

static void find_rows(const Islands *islands, int which, Elimination *e) {
    e->active = 0;
    e->bilateral = 0;
    e->kept = 0;
    for (int k = 0; k < e->problem->rows; k++) {
        const Row *row = &e->problem->row[k];
        e->place[k] = e->place_kept[k] = -1;
        if (row->law == ROW_FREE || islands->island[k] != which) {
            continue;
        }
        e->place_kept[k] = e->kept;
        e->row_kept[e->kept++] = k;
        if (row->law == ROW_BILATERAL) {
            e->order[e->bilateral++] = k;
        }
        if (is_active(row)) {
            e->place[k] = e->active;
            e->row[e->active++] = k;
        }
    }
}

static void describe(const Elimination *e, Laws *laws) {
    laws->size = e->active;
    for (int i = 0; i < e->active; i++) {
        const int k = e->row[i];
        const Row *row = &e->problem->row[k];
        const bool follows = row->law == ROW_TANGENTIAL && e->problem->row[row->normal].law == ROW_UNILATERAL;
        const bool pair = k + 1 < e->problem->rows && is_second(e->problem->row, k + 1);
        laws->normal[i] = follows ? e->place[row->normal] : -1;
        laws->width[i] = row->law == ROW_UNILATERAL ? 0 : is_second(e->problem->row, k) ? -1 : pair ? 2 : 1;
    }
}

void set_limit(const Elimination *e, int place, double limit, Laws *laws) {
    const int row = e->row[place];
    const Row *it = &e->problem->row[row];
    const bool tangential = it->law == ROW_TANGENTIAL;
    laws->base[place] = tangential ? limit * fmax(given(e, it->normal), 0.0) * e->scale[it->normal] : limit;
    laws->base[place] /= e->scale[row];
    laws->slope[place] = tangential ? limit * e->scale[it->normal] / e->scale[row] : 0.0;
}

/* Clears the matrix and offset of each row along which the bilateral rows alone determine the motion. What elimination
   has left there is rounding, and would look like the influence of a force or like a motion. */
static void clear_determined(const Elimination *e, const double response[], Laws *laws) {
    for (int i = 0; i < e->active; i++) {
        double rest = reduced_entry(e, e->row[i], e->row[i]);
        for (int k = 0; k < e->rank; k++) {
            rest -= response[i * e->bilateral + k] * response[i * e->bilateral + k];
        }
        if (!(rest > REDUNDANT)) {
            memset(laws->matrix.value + i * e->active, 0, (size_t)e->active * sizeof(double));
            laws->offset[i] = fabs(laws->offset[i]) > OBEYED * laws->terms[i] ? laws->offset[i] : 0.0;
        }
        laws->determined[i] = !(rest > REDUNDANT);
    }
}

/* a - b . c, exactly 0 where it is rounding error, and the sum of the absolute terms. */
static double difference(double a, const double b[], const double c[], int count, double *terms) {
    double sum = a;
    *terms = fabs(a);
    for (int k = 0; k < count; k++) {
        sum -= b[k] * c[k];
        *terms += fabs(b[k] * c[k]);
    }
    return fabs(sum) > NOISE * *terms ? sum : 0.0;
}

/* The rows and the arrays of the elimination, of which those for each row are large enough for any. */
static void take_rows(Elimination *e) {
    Arena *arena = e->problem->arena;
    const size_t rows = (size_t)e->problem->rows;
    e->free = (double *)arena_take(arena, rows * sizeof(double));
    e->row_kept = (int *)arena_take(arena, rows * sizeof(int));
    e->place_kept = (int *)arena_take(arena, rows * sizeof(int));
    e->row = (int *)arena_take(arena, rows * sizeof(int));
    e->place = (int *)arena_take(arena, rows * sizeof(int));
    e->order = (int *)arena_take(arena, rows * sizeof(int));
}

static void take_matrices(Elimination *e) {
    Arena *arena = e->problem->arena;
    const size_t kept = (size_t)e->kept, bilateral = (size_t)e->bilateral;
    e->delassus = (double *)arena_take(arena, kept * kept * sizeof(double));
    e->factor = (double *)arena_take(arena, bilateral * bilateral * sizeof(double));
    memset(e->factor, 0, bilateral * bilateral * sizeof(double));
}

/* Room for the matrices of the elimination and of the laws, and for two more of the larger one of laws and bilateral
   rows, which elimination, a choice of equations and their solution of least norm take in turn. */
static bool reserve_matrices(const Problem *problem, size_t kept, size_t active, size_t bilateral) {
    const size_t larger = active > bilateral ? active : bilateral;
    const size_t matrices = kept * kept + bilateral * bilateral + 2 * active * active + 2 * larger * larger;
    return arena_reserve(problem->arena, (matrices + 32 * (kept + 8) + 4 * (size_t)problem->rows) * sizeof(double));
}

/* The elements of the laws, but for the limits of friction. */
static void fill_laws(const Elimination *e, Laws *laws) {
    const Problem *problem = e->problem;
    const ArenaMark mark = arena_mark(problem->arena);
    const size_t bytes = (size_t)problem->rows * sizeof(double);
    const int m = e->bilateral;
    double *column = (double *)arena_take(problem->arena, bytes), terms;
    double *known = (double *)arena_take(problem->arena, bytes);
    double *seen = (double *)arena_take(problem->arena, bytes);
    double *response = (double *)arena_take(problem->arena, (size_t)(e->active * m) * sizeof(double));
    for (int a = 0; a < e->kept; a++) {
        column[e->row_kept[a]] = e->free[e->row_kept[a]];
    }
    for (int a = 0; a < e->kept; a++) {
        add_column(e, e->row_kept[a], given(e, e->row_kept[a]), column);
    }
    solve_lower(e, column, known);
    for (int i = 0; i < e->active; i++) {
        const int row = e->row[i];
        for (int k = 0; k < e->rank; k++) {
            seen[e->order[k]] = reduced_entry(e, row, e->order[k]); /* the matrix is symmetric */
        }
        solve_lower(e, seen, response + i * m);
        laws->offset[i] = difference(column[row], response + i * m, known, e->rank, &laws->terms[i]);
    }
    for (int j = 0; j < e->active; j++) {
        column_of(e, e->row[j], column);
        solve_lower(e, column, seen);
        for (int i = 0; i < e->active; i++) {
            laws->matrix.value[i * e->active + j] =
                difference(column[e->row[i]], response + i * m, seen, e->rank, &terms);
        }
    }
    clear_determined(e, response, laws);
    arena_release(mark);
}

bool eliminate_rows(const Problem *problem, const Islands *islands, int which, Elimination *e, Laws *laws) {
    e->problem = problem;
    e->scale = islands->scale;
    if (!arena_reserve(problem->arena, (5 * (size_t)problem->rows + 16) * sizeof(double))) {
        return false;
    }
    take_rows(e);
    find_rows(islands, which, e);
    if (!reserve_matrices(problem, (size_t)e->kept, (size_t)e->active, (size_t)e->bilateral)) {
        return false;
    }
    take_matrices(e);
    *laws = laws_take(problem->arena, sparse_full(problem->arena, e->active, e->active));
    scale_rows(e);
    factorize_bilateral(e);
    describe(e, laws);
    fill_laws(e, laws);
    laws_curve(laws);
    return true;
}

/* Bilateral rows, given the others: lambda[rows] is scaled. */
static void solve_bilateral(const Elimination *e, double lambda[]) {
    Arena *arena = e->problem->arena;
    const ArenaMark mark = arena_mark(arena);
    const int m = e->bilateral;
    const size_t bytes = (size_t)m * sizeof(double);
    double *matrix = (double *)arena_take(arena, (size_t)m * bytes), *right = (double *)arena_take(arena, bytes);
    double *x = (double *)arena_take(arena, bytes);
    for (int i = 0; i < m; i++) {
        right[i] = -e->free[e->order[i]];
        for (int a = 0; a < e->kept; a++) {
            right[i] -= reduced_entry(e, e->order[i], e->row_kept[a]) * lambda[e->row_kept[a]];
        }
        for (int j = 0; j < m; j++) {
            matrix[i * m + j] = reduced_entry(e, e->order[i], e->order[j]);
        }
    }
    least_norm_solve(arena, m, matrix, right, x);
    for (int i = 0; i < m; i++) {
        lambda[e->order[i]] = x[i];
    }
    arena_release(mark);
}

void recover_rows(const Elimination *e, const double x[], double lambda[]) {
    for (int a = 0; a < e->kept; a++) {
        const int k = e->row_kept[a];
        lambda[k] = given(e, k) + (e->place[k] >= 0 ? x[e->place[k]] : 0.0);
    }
    for (int a = 0; a < e->kept; a++) {
        const int k = e->row_kept[a];
        const Row *row = &e->problem->row[k];
        if (row->law == ROW_SLIDING && e->place[row->normal] >= 0) {
            lambda[k] = drag(e, k) * lambda[row->normal];
        }
    }
    solve_bilateral(e, lambda);
    for (int a = 0; a < e->kept; a++) {
        lambda[e->row_kept[a]] *= e->scale[e->row_kept[a]];
    }
}
