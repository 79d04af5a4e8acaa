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

/* Is this the second tangential row of its contact? The rows before it of the same contact decide. */
static bool is_second(const Problem *problem, int k) {
    int before = 0;
    for (int i = k - 1; i >= 0 && problem->row[i].law == ROW_TANGENTIAL &&
                        problem->row[i].normal == problem->row[k].normal; i--) {
        before++;
    }
    return problem->row[k].law == ROW_TANGENTIAL && before % 2 == 1;
}

static double scale_for(double diagonal) {
    return diagonal > 0.0 ? 1.0 / sqrt(diagonal) : 1.0;
}

static void scale_rows(Elimination *e) {
    const Problem *problem = e->problem;
    const int n = problem->rows;
    for (int k = 0; k < n; k++) {
        e->scale[k] = scale_for(problem->delassus[k * n + k]);
        if (k > 0 && is_second(problem, k)) {
            const double sum = problem->delassus[k * n + k] + problem->delassus[(k - 1) * n + k - 1];
            e->scale[k] = scale_for(0.5 * sum);
            e->scale[k - 1] = e->scale[k];
        }
    }
    for (int i = 0; i < n; i++) {
        for (int j = 0; j < n; j++) {
            e->delassus[i * n + j] = e->scale[i] * problem->delassus[i * n + j] * e->scale[j];
        }
        e->free[i] = e->scale[i] * problem->free[i];
    }
}

/* The remaining diagonal entry of the bilateral row at a place. */
static double rest_of(const Elimination *e, int place, int rank) {
    const int row = e->order[place];
    double rest = e->delassus[row * e->problem->rows + row];
    for (int k = 0; k < rank; k++) {
        rest -= e->factor[place * SIZE_ROWS + k] * e->factor[place * SIZE_ROWS + k];
    }
    return rest;
}

static void exchange_places(Elimination *e, int a, int b) {
    const int row = e->order[a];
    e->order[a] = e->order[b];
    e->order[b] = row;
    for (int k = 0; k < SIZE_ROWS; k++) {
        const double entry = e->factor[a * SIZE_ROWS + k];
        e->factor[a * SIZE_ROWS + k] = e->factor[b * SIZE_ROWS + k];
        e->factor[b * SIZE_ROWS + k] = entry;
    }
}

static void factorize_bilateral(Elimination *e) {
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
            double entry = e->delassus[e->order[i] * e->problem->rows + e->order[k]];
            for (int j = 0; j < k; j++) {
                entry -= e->factor[i * SIZE_ROWS + j] * e->factor[k * SIZE_ROWS + j];
            }
            e->factor[i * SIZE_ROWS + k] = i == k ? sqrt(pivot) : entry / sqrt(pivot);
        }
    }
}

/* y[rank] = L^-1 of the bilateral entries of a column[rows]. */
static void solve_lower(const Elimination *e, const double column[], double y[]) {
    for (int i = 0; i < e->rank; i++) {
        y[i] = column[e->order[i]];
        for (int k = 0; k < i; k++) {
            y[i] -= e->factor[i * SIZE_ROWS + k] * y[k];
        }
        y[i] /= e->factor[i * SIZE_ROWS + i];
    }
}

/* What a row says of the others: w of all rows for lambda 1 of an active row, with what slides on it. */
static void add_column(const Elimination *e, int row, double lambda, double column[]) {
    for (int i = 0; i < e->problem->rows; i++) {
        column[i] += e->delassus[i * e->problem->rows + row] * lambda;
    }
}

/* lambda of a sliding row for lambda 1 of its normal, both scaled. */
static double drag(const Elimination *e, int row) {
    const Row *sliding = &e->problem->row[row];
    return -sliding->friction * sliding->value * e->scale[sliding->normal] / e->scale[row];
}

static void column_of(const Elimination *e, int row, double column[]) {
    memset(column, 0, (size_t)e->problem->rows * sizeof(double));
    add_column(e, row, 1.0, column);
    for (int k = 0; k < e->problem->rows; k++) {
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

static void find_rows(Elimination *e) {
    e->active = 0;
    e->bilateral = 0;
    for (int k = 0; k < e->problem->rows; k++) {
        const Row *row = &e->problem->row[k];
        e->place[k] = is_active(row) ? e->active : -1;
        if (row->law == ROW_BILATERAL) {
            e->order[e->bilateral++] = k;
        }
        if (is_active(row)) {
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
        const bool pair = k + 1 < e->problem->rows && is_second(e->problem, k + 1);
        laws->normal[i] = follows ? e->place[row->normal] : -1;
        laws->width[i] = row->law == ROW_UNILATERAL ? 0 : is_second(e->problem, k) ? -1 : pair ? 2 : 1;
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

/* Rounding errors of a row that the bilateral rows determine must look neither like an influence on it nor like a
   motion along it. */
static void clear_determined(const Elimination *e, double response[][SIZE_ROWS], Laws *laws) {
    for (int i = 0; i < e->active; i++) {
        double rest = e->delassus[e->row[i] * e->problem->rows + e->row[i]];
        for (int k = 0; k < e->rank; k++) {
            rest -= response[i][k] * response[i][k];
        }
        if (!(rest > REDUNDANT)) {
            memset(laws->matrix + i * e->active, 0, (size_t)e->active * sizeof(double));
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

void eliminate_rows(const Problem *problem, Elimination *e, Laws *laws) {
    double column[SIZE_ROWS], known[SIZE_ROWS], seen[SIZE_ROWS], response[MOST_ACTIVE][SIZE_ROWS], terms;
    e->problem = problem;
    memset(e->factor, 0, sizeof e->factor);
    scale_rows(e);
    find_rows(e);
    factorize_bilateral(e);
    describe(e, laws);
    memcpy(column, e->free, (size_t)problem->rows * sizeof(double));
    for (int k = 0; k < problem->rows; k++) {
        add_column(e, k, given(e, k), column);
    }
    solve_lower(e, column, known);
    for (int i = 0; i < e->active; i++) {
        const int row = e->row[i];
        solve_lower(e, e->delassus + row * problem->rows, response[i]); /* the matrix is symmetric */
        laws->offset[i] = difference(column[row], response[i], known, e->rank, &laws->terms[i]);
    }
    for (int j = 0; j < e->active; j++) {
        column_of(e, e->row[j], column);
        solve_lower(e, column, seen);
        for (int i = 0; i < e->active; i++) {
            laws->matrix[i * e->active + j] = difference(column[e->row[i]], response[i], seen, e->rank, &terms);
        }
    }
    clear_determined(e, response, laws);
}

/* Bilateral rows, given the others: lambda[rows] is scaled. */
static void solve_bilateral(const Elimination *e, double lambda[]) {
    double matrix[SIZE_ROWS * SIZE_ROWS] = {0.0}, right[SIZE_ROWS] = {0.0}, x[SIZE_ROWS];
    const int m = e->bilateral, n = e->problem->rows;
    for (int i = 0; i < m; i++) {
        right[i] = -e->free[e->order[i]];
        for (int j = 0; j < n; j++) {
            right[i] -= e->delassus[e->order[i] * n + j] * lambda[j];
        }
        for (int j = 0; j < m; j++) {
            matrix[i * m + j] = e->delassus[e->order[i] * n + e->order[j]];
        }
    }
    least_norm_solve(m, matrix, right, x);
    for (int i = 0; i < m; i++) {
        lambda[e->order[i]] = x[i];
    }
}

/* The sum of the absolute terms of w = free + delassus lambda in a row. */
static double terms_of(const Problem *problem, const double lambda[], int row) {
    double sum = fabs(problem->free[row]);
    for (int j = 0; j < problem->rows; j++) {
        sum += fabs(problem->delassus[row * problem->rows + j] * lambda[j]);
    }
    return sum;
}

/* w = free + delassus lambda, 0 where it is rounding error: of the terms in the row, or what solving all rows together
   leaves in a row whose own terms are as small. */
static void evaluate_rows(const Elimination *e, const double lambda[], double w[]) {
    const Problem *problem = e->problem;
    double greatest = 0.0;
    for (int i = 0; i < problem->rows; i++) {
        greatest = fmax(greatest, e->scale[i] * terms_of(problem, lambda, i));
    }
    for (int i = 0; i < problem->rows; i++) {
        const double rounding = SOLVED * terms_of(problem, lambda, i) + NOISE * greatest / e->scale[i];
        w[i] = problem->free[i];
        for (int j = 0; j < problem->rows; j++) {
            w[i] += problem->delassus[i * problem->rows + j] * lambda[j];
        }
        w[i] = fabs(w[i]) > rounding ? w[i] : 0.0;
    }
}

void recover_rows(const Elimination *e, const double x[], double lambda[], double w[]) {
    const int n = e->problem->rows;
    for (int k = 0; k < n; k++) {
        lambda[k] = given(e, k) + (e->place[k] >= 0 ? x[e->place[k]] : 0.0);
    }
    for (int k = 0; k < n; k++) {
        const Row *row = &e->problem->row[k];
        if (row->law == ROW_SLIDING && e->place[row->normal] >= 0) {
            lambda[k] = drag(e, k) * lambda[row->normal];
        }
    }
    solve_bilateral(e, lambda);
    for (int k = 0; k < n; k++) {
        lambda[k] *= e->scale[k];
    }
    evaluate_rows(e, lambda, w);
}
