/* Cholesky with diagonal pivoting, which shows the rank. Golub and Van Loan, Matrix Computations, 4th edition, sections
   4.2.8 (pivoting) and 5.5 (solutions of least norm). */
#include "constraint_factorization.h"

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <string.h>

#include "scale.h"
#include "sizes.h"

static double inner_product(const double a[], const double b[], int count) {
    double sum = 0.0;
    for (int i = 0; i < count; i++) {
        sum += a[i] * b[i];
    }
    return sum;
}

/* The columns of row k beyond which there are zeros only: where many bodies touch, each row concerns few of them. */
static void find_columns(ConstraintFactorization *result, int k) {
    const double *row = result->jacobian + k * N, *response = result->response + k * N;
    int begin = 0, end = N;
    if (N_COORDINATES < MANY_COLUMNS) {
        return;
    }
    while (begin < end && row[begin] == 0.0 && response[begin] == 0.0) {
        begin++;
    }
    while (end > begin && row[end - 1] == 0.0 && response[end - 1] == 0.0) {
        end--;
    }
    result->begin[k] = begin;
    result->end[k] = end;
}

/* D: a row that restricts nothing gets the scale 0. */
static void scale_gradients(ConstraintFactorization *result) {
    for (int k = 0; k < result->rows; k++) {
        find_columns(result, k);
        const int begin = k * N + row_begin(result, k), count = row_end(result, k) - row_begin(result, k);
        const double square = inner_product(result->jacobian + begin, result->response + begin, count);
        result->scale[k] = square > 0.0 ? 1.0 / sqrt(square) : 0.0;
    }
}

/* The full matrix P D G M^-1 G^T D P^T in factor. The loops run along the rows of G, which have many zeros, and add to
   all sums of a row in turn. */
static void multiply(Arena *arena, ConstraintFactorization *result) {
    const ArenaMark mark = arena_mark(arena);
    WORK(mark, double, sum, K);
    for (int i = 0; i < result->rows; i++) {
        const int row = result->order[i];
        memset(sum, 0, K * sizeof(double));
        for (int column = row_begin(result, row); column < row_end(result, row); column++) {
            const double slope = result->jacobian[row * N + column];
            for (int j = 0; slope != 0.0 && j <= i; j++) {
                const int other = result->order[j];
                if (column >= row_begin(result, other) && column < row_end(result, other)) {
                    sum[j] += slope * result->response[other * N + column];
                }
            }
        }
        for (int j = 0; j <= i; j++) {
            const double entry = result->scale[row] * sum[j] * result->scale[result->order[j]];
            result->factor[i * K + j] = entry;
            result->factor[j * K + i] = entry;
        }
    }
    arena_release(mark);
}

static void swap(double *a, double *b) {
    const double kept = *a;
    *a = *b;
    *b = kept;
}

/* Two rows change places. */
static void exchange_rows(ConstraintFactorization *result, int k, int other) {
    double *a = result->factor;
    if (K > 1 && other != k) {
        const int kept = result->order[k];
        result->order[k] = result->order[other];
        result->order[other] = kept;
        for (int j = 0; j < result->rows; j++) {
            swap(&a[k * K + j], &a[other * K + j]);
        }
        for (int i = 0; i < result->rows; i++) {
            swap(&a[i * K + k], &a[i * K + other]);
        }
    }
}

double constraints_slope(const double jacobian[], int k) {
    double slope = 0.0;
    for (int i = 0; i < N; i++) {
        slope = fmax(slope, fabs(jacobian[k * N + i]) * NOMINAL_STATES[i]);
    }
    return slope;
}

/* share[rows]: the square of the part that each row has of its usual slope; 1 where that is not known. */
static void find_shares(const ConstraintFactorization *f, const IndependentRows *known, double share[]) {
    for (int row = 0; row < f->rows; row++) {
        const double usual = known == NULL ? 0.0 : known->slope[row];
        const double part = usual > 0.0 ? fmin(1.0, constraints_slope(f->jacobian, row) / usual) : 1.0;
        share[row] = part * part;
    }
}

/* The square of the distance of the row at place k from the span of those that are eliminated, in units of its length;
   of its usual length, where that is greater: errors of the states turn a row that has become short. */
static double clarity(const ConstraintFactorization *f, const double share[], int k) {
    return f->factor[k * K + k] * share[f->order[k]];
}

/* The place, from k, of the clearest row. */
static int clearest_row(const ConstraintFactorization *f, const double share[], int k) {
    int best = k;
    for (int i = k + 1; i < f->rows; i++) {
        best = clarity(f, share, i) > clarity(f, share, best) ? i : best;
    }
    return best;
}

/* Brings the clearest row to place k; returns its clarity. */
static double bring_row(ConstraintFactorization *result, const double share[], int k) {
    exchange_rows(result, k, clearest_row(result, share, k));
    return clarity(result, share, k);
}

/* Writes column k of L, and the same as row k behind the diagonal, and takes its part out of the rest of the matrix.
   The loops run along row k, which has many zeros where many bodies touch. */
static void eliminate(double a[], int rows, int k) {
    double *row = a + k * K;
    row[k] = sqrt(row[k]);
    for (int i = k + 1; i < rows; i++) {
        if (row[i] != 0.0) {
            row[i] /= row[k];
            a[i * K + k] = row[i];
        }
    }
    for (int i = k + 1; i < rows; i++) {
        const double factor = row[i];
        for (int j = k + 1; j <= i && factor != 0.0; j++) {
            if (N_COORDINATES < MANY_COLUMNS || row[j] != 0.0) {
                a[i * K + j] -= factor * row[j];
                a[j * K + i] = a[i * K + j];
            }
        }
    }
}

/* L^T L = normal normal^T. */
static void factorize_normal(const ConstraintFactorization *f, double normal[]) {
    for (int i = 0; i < f->rank; i++) {
        for (int j = 0; j <= i; j++) {
            double sum = 0.0;
            for (int k = i; k < f->rows; k++) {
                sum += f->factor[k * K + i] * f->factor[k * K + j];
            }
            normal[i * K + j] = sum;
            normal[j * K + i] = sum;
        }
    }
    for (int k = 0; k < f->rank; k++) {
        eliminate(normal, f->rank, k);
    }
}

/* Sets the order to begin with: the known independent rows come first. Returns how many of them there are. */
static int order_rows(ConstraintFactorization *result, const IndependentRows *known) {
    int placed = 0;
    int independent = 0;
    for (int i = 0; i < K; i++) {
        const int row = known == NULL ? i : (int)known->order[i];
        if (row < result->rows) {
            independent += known != NULL && i < known->rank;
            result->order[placed++] = row;
        }
    }
    return independent;
}

double constraints_distance(const ConstraintFactorization *f, int k) {
    return f->factor[k * K + k] / f->scale[f->order[k]];
}

/* How far the row at place k is held to its usual multiplier: from 0, not at all, to 1, with a continuous slope. */
static double hold(const ConstraintFactorization *f, const IndependentRows *known, int k) {
    const double usual = known->distance[f->order[k]];
    if (!(usual > 0.0)) {
        return 0.0;
    }
    const double ratio = constraints_distance(f, k) / usual;
    const double rest = 1.0 - ratio * ratio / ABOUT_TO_BE_LOST;
    return rest > 0.0 ? rest * rest : 0.0;
}

double constraints_weakened(double usual) {
    return sqrt(CLEARLY_INDEPENDENT) * usual * usual;
}

/* Is the known row at place k, which is next, much nearer than usual to the rows before it? */
static bool weakened(const ConstraintFactorization *f, const IndependentRows *known, int k) {
    return f->factor[k * K + k] < constraints_weakened(known->distance[f->order[k]] * f->scale[f->order[k]]);
}

/* Brings a clearly independent row, if there is one, to place k, whose known row is weakened. There is none at a
   singular position. */
static bool replace_row(ConstraintFactorization *result, const double share[], int k) {
    const int other = clearest_row(result, share, k);
    const bool clear = other != k && clarity(result, share, other) > CLEARLY_INDEPENDENT;
    exchange_rows(result, k, clear ? other : k);
    return clear;
}

void constraints_factorize(Arena *arena, ConstraintFactorization *result, int rows, const IndependentRows *known,
                           double damping) {
    const ArenaMark mark = arena_mark(arena);
    WORK(mark, double, share, K);
    result->rows = rows;
    result->rank = 0;
    memset(result->held, 0, sizeof result->held);
    result->holding = false;
    scale_gradients(result);
    find_shares(result, known, share);
    const int independent = order_rows(result, known);
    multiply(arena, result);
    for (int k = 0; k < rows; k++) {
        result->factor[k * K + k] += result->scale[result->order[k]] > 0.0 ? damping : 0.0;
    }
    int strong = independent; /* the place of the known rows that wait until the others are eliminated */
    for (int k = 0; k < rows; k++) {
        while (k < strong && independent < rows && weakened(result, known, k)) {
            exchange_rows(result, k, --strong);
        }
        const bool replaced = k >= strong && k < independent && replace_row(result, share, k);
        const double least = independent > 0 && k >= independent && damping <= 0.0 ? CLEARLY_INDEPENDENT : REDUNDANT;
        const bool kept = k < independent && !replaced && result->factor[k * K + k] > REDUNDANT;
        if (!kept && !(bring_row(result, share, k) > least)) {
            break;
        }
        eliminate(result->factor, rows, k);
        const double held = kept ? hold(result, known, k) : 0.0;
        result->held[result->order[k]] = held;
        result->holding = result->holding || held > 0.0;
        result->rank++;
    }
    arena_release(mark);
}

/* Overwrites b[size] by L^-1 b. */
static void solve_lower_factor(const double lower[], int size, double b[]) {
    for (int i = 0; i < size; i++) {
        b[i] = (b[i] - inner_product(lower + i * K, b, i)) / lower[i * K + i];
    }
}

/* Overwrites b[size] by L^-T b. */
static void solve_upper(const double lower[], int size, double b[]) {
    for (int i = size - 1; i >= 0; i--) {
        b[i] /= lower[i * K + i];
        const double found = b[i];
        for (int j = 0; j < i && found != 0.0; j++) {
            b[j] -= lower[i * K + j] * found;
        }
    }
}

void constraints_solve(Arena *arena, const ConstraintFactorization *f, const double b[], const double usual[],
                       double multipliers[]) {
    const ArenaMark mark = arena_mark(arena);
    WORK(mark, double, z, K);
    WORK(mark, double, other, K);
    int begin = 0; /* z is 0 before it */
    for (int i = 0; i < f->rank; i++) {
        const int row = f->order[i];
        const double *lower = f->factor + i * K;
        z[i] = (f->scale[row] * b[row] - inner_product(lower + begin, z + begin, i - begin)) / lower[i];
        if (f->holding) {
            other[i] = usual == NULL ? 0.0 : (f->scale[row] * usual[row] - inner_product(lower, other, i)) / lower[i];
            z[i] += f->held[row] * (other[i] - z[i]);
        }
        begin = begin == i && z[i] == 0.0 ? i + 1 : begin;
    }
    solve_upper(f->factor, f->rank, z);
    for (int i = 0; i < f->rows; i++) {
        multipliers[f->order[i]] = i < f->rank ? f->scale[f->order[i]] * z[i] : 0.0;
    }
    arena_release(mark);
}

/* L^T times any solution is the same; the one of least norm is L (L^T L)^-1 times that. */
void constraints_spread(Arena *arena, const ConstraintFactorization *f, double multipliers[]) {
    const ArenaMark mark = arena_mark(arena);
    WORK(mark, double, normal, K * K);
    WORK(mark, double, z, K);
    if (f->rank == f->rows) {
        arena_release(mark);
        return;
    }
    factorize_normal(f, normal);
    for (int i = 0; i < f->rank; i++) {
        z[i] = 0.0;
        for (int k = i; k < f->rows; k++) {
            const double scale = f->scale[f->order[k]];
            z[i] += scale > 0.0 ? f->factor[k * K + i] * multipliers[f->order[k]] / scale : 0.0;
        }
    }
    solve_lower_factor(normal, f->rank, z);
    solve_upper(normal, f->rank, z);
    for (int i = 0; i < f->rows; i++) {
        const int columns = i < f->rank ? i + 1 : f->rank;
        const int row = f->order[i];
        if (f->scale[row] > 0.0) {
            multipliers[row] = f->scale[row] * inner_product(f->factor + i * K, z, columns);
        }
    }
    arena_release(mark);
}

void constraints_respond(const ConstraintFactorization *f, const double multipliers[], double a[]) {
    for (int k = 0; k < f->rows; k++) {
        const double multiplier = multipliers[k];
        for (int i = row_begin(f, k); i < row_end(f, k) && multiplier != 0.0; i++) {
            a[i] += multiplier * f->response[k * N + i];
        }
    }
}
