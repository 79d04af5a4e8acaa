/* Lemke's method on a condensed tableau: basic = q + T nonbasic. Variables are numbered: y are 0 to n - 1, z are n to
   2 n - 1, the artificial variable z0 is 2 n. */
#include "lemke.h"

#include <math.h>
#include <string.h>

#include "mechanism.h"
#include "scale.h"

enum { MAX_PIVOTS = 50 + 60 * SIZE_ACTIVE };

typedef struct {
    int n;
    double *entry; /* [n * (n + 1)] */
    double *value; /* [n], of the basic variables */
    int *basic;    /* [n]: row -> variable */
    int *nonbasic; /* [n + 1]: column -> variable */
    int *place;    /* [2 n + 1]: variable -> its row, or -1 - its column */
    double first;  /* the first value of z0 */
} LemkeTableau;

static double *row_of(LemkeTableau *t, int row) {
    return t->entry + row * (t->n + 1);
}

static void start_tableau(Arena *arena, LemkeTableau *t, const Lcp *problem) {
    const int n = problem->size;
    const size_t size = (size_t)n;
    t->n = n;
    t->entry = arena_take(arena, size * (size + 1) * sizeof(double));
    t->value = arena_take(arena, size * sizeof(double));
    t->basic = arena_take(arena, size * sizeof(int));
    t->nonbasic = arena_take(arena, (size + 1) * sizeof(int));
    t->place = arena_take(arena, (2 * size + 1) * sizeof(int));
    for (int i = 0; i < n; i++) {
        memcpy(row_of(t, i), problem->matrix + i * n, (size_t)n * sizeof(double));
        row_of(t, i)[n] = 1.0;
        t->value[i] = problem->offset[i];
        t->basic[i] = i;
        t->place[i] = i;
        t->nonbasic[i] = n + i;
        t->place[n + i] = -1 - i;
    }
    t->nonbasic[n] = 2 * n;
    t->place[2 * n] = -1 - n;
}

/* Solves the row for the variable of the column, and puts that into the other rows. */
static void exchange(LemkeTableau *t, int row, int column) {
    const int n = t->n;
    double *pivot_row = row_of(t, row);
    const double pivot = pivot_row[column];
    for (int j = 0; j <= n; j++) {
        pivot_row[j] = j == column ? 1.0 / pivot : -pivot_row[j] / pivot;
    }
    t->value[row] = -t->value[row] / pivot;
    for (int i = 0; i < n; i++) {
        double *other = row_of(t, i);
        const double factor = other[column];
        if (i == row || factor == 0.0) {
            continue;
        }
        other[column] = 0.0;
        for (int j = 0; j <= n; j++) {
            other[j] += factor * pivot_row[j];
        }
        t->value[i] += factor * t->value[row];
    }
    const int leaving = t->basic[row];
    t->basic[row] = t->nonbasic[column];
    t->nonbasic[column] = leaving;
    t->place[t->basic[row]] = row;
    t->place[leaving] = -1 - column;
}

/* The coefficient of the kth power of an infinitesimal perturbation, which is added to q[k], in a row. */
static double perturbation(LemkeTableau *t, int row, int k) {
    const int place = t->place[k];
    return place < 0 ? -row_of(t, row)[-1 - place] : place == row ? 1.0 : 0.0;
}

/* Is the variable of row i sooner 0 than that of row j, or at the same time and sooner with the perturbation? */
static bool sooner(LemkeTableau *t, int column, int i, int j) {
    const double a = -row_of(t, i)[column], b = -row_of(t, j)[column];
    const double first = t->value[i] / a, second = t->value[j] / b;
    if (fabs(first - second) > SOLVED * fmax(fabs(first), fabs(second))) {
        return first < second;
    }
    if (t->basic[i] == 2 * t->n || t->basic[j] == 2 * t->n) {
        return t->basic[i] == 2 * t->n;
    }
    for (int k = 0; k < t->n; k++) {
        const double left = perturbation(t, i, k) / a, right = perturbation(t, j, k) / b;
        if (fabs(left - right) > SOLVED * fmax(fabs(left), fabs(right))) {
            return left < right;
        }
    }
    return false;
}

/* The row whose variable falls to 0 first when that of the column grows; -1: none does. */
static int leaving_row(LemkeTableau *t, int column) {
    double largest = 0.0;
    int best = -1;
    for (int i = 0; i < t->n; i++) {
        largest = fmax(largest, fabs(row_of(t, i)[column]));
    }
    const double least = fmax(ACCEPTED * largest, MET);
    for (int i = 0; i < t->n; i++) {
        if (row_of(t, i)[column] < -least && (best < 0 || sooner(t, column, i, best))) {
            best = i;
        }
    }
    return best;
}

/* Brings z0 in so that no variable is negative; returns the variable that leaves, or -1 if none was negative. */
static int bring_artificial(LemkeTableau *t) {
    int worst = -1;
    for (int i = 0; i < t->n; i++) {
        if (t->value[i] < 0.0 && (worst < 0 || t->value[i] <= t->value[worst])) {
            worst = i;
        }
    }
    if (worst >= 0) {
        t->first = -t->value[worst];
        exchange(t, worst, t->n);
    }
    return worst;
}

static bool pivot_to_the_end(LemkeTableau *t) {
    const int n = t->n, artificial = 2 * t->n;
    int left = bring_artificial(t);
    for (int pivots = 0; left >= 0 && left != artificial; pivots++) {
        const int entering = left < n ? left + n : left - n;
        const int column = -1 - t->place[entering];
        const int row = pivots < MAX_PIVOTS ? leaving_row(t, column) : -1;
        if (row < 0) {
            return t->value[t->place[artificial]] <= ACCEPTED * t->first;
        }
        left = t->basic[row];
        exchange(t, row, column);
    }
    return true;
}

bool lemke_solve(Arena *arena, const Lcp *problem, double z[], bool positive[]) {
    const ArenaMark mark = arena_mark(arena);
    LemkeTableau t;
    const int n = problem->size;
    start_tableau(arena, &t, problem);
    const bool solved = pivot_to_the_end(&t);
    for (int k = 0; k < n; k++) {
        const int place = t.place[n + k];
        positive[k] = place >= 0;
        z[k] = positive[k] ? fmax(t.value[place], 0.0) : 0.0;
    }
    return arena_leave(mark, solved);
}
