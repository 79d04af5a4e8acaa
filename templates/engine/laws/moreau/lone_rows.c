/* The tangential force of a contact in the plane is a function of the normal one, in pieces that are linear. Where
   friction times the coupling of both is less than the entry of the normal, the motion along the normal grows with the
   force in each piece, and there is one solution. Lotstedt, Coulomb friction in two-dimensional rigid body systems,
   Z. Angew. Math. Mech. 61, 1981. */
#include "lone_rows.h"

#include <math.h>

#include "scale.h"

/* The entry of the operator in row i and column j. */
static double entry_of(const Sparse *delassus, int i, int j) {
    double entry = 0.0;
    for (int e = delassus->start[i]; e < delassus->start[i + 1]; e++) {
        entry = delassus->column[e] == j ? delassus->value[e] : entry;
    }
    return entry;
}

static bool solve_row(const SparseProblem *problem, int i, double *lambda) {
    const Row *row = &problem->row[i];
    const double own = entry_of(&problem->delassus, i, i);
    if (!(own > 0.0) || row->law == ROW_TANGENTIAL) {
        return false;
    }
    const double holding = -problem->free[i] / own;
    *lambda = row->law == ROW_UNILATERAL ? fmax(holding, 0.0)
              : row->law == ROW_BOUNDED  ? fmax(-row->friction, fmin(holding, row->friction))
                                         : holding;
    return true;
}

/* lambda[2] of the rows n and n + 1. */
static bool solve_contact(const SparseProblem *problem, int n, double lambda[]) {
    const Sparse *delassus = &problem->delassus;
    const double a = entry_of(delassus, n, n), b = entry_of(delassus, n, n + 1);
    const double c = entry_of(delassus, n + 1, n + 1), free = problem->free[n], slip = problem->free[n + 1];
    const double friction = problem->row[n + 1].friction, regular = a * c - b * b;
    if (!(friction * fabs(b) < a) || !(regular > REDUNDANT * a * c)) {
        return false;
    }
    lambda[0] = lambda[1] = 0.0;
    if (free >= 0.0) {
        return true;
    }
    for (double way = -1.0; way <= 1.0; way += 2.0) { /* of the slip; the force is against it */
        lambda[0] = -free / (a - way * friction * b);
        lambda[1] = -way * friction * lambda[0];
        if (way * (slip + b * lambda[0] + c * lambda[1]) > 0.0) {
            return true;
        }
    }
    lambda[0] = (b * slip - c * free) / regular;
    lambda[1] = fmax(-friction * lambda[0], fmin((b * free - a * slip) / regular, friction * lambda[0]));
    return true;
}

/* The motion along two rows without friction has one solution: both hold, or one is open, or both are. */
static bool solve_pair(const SparseProblem *problem, int i, int j, double lambda[]) {
    const Sparse *delassus = &problem->delassus;
    const double a = entry_of(delassus, i, i), b = entry_of(delassus, i, j), c = entry_of(delassus, j, j);
    const double free[] = {problem->free[i], problem->free[j]}, regular = a * c - b * b;
    const bool opens[] = {problem->row[i].law == ROW_UNILATERAL, problem->row[j].law == ROW_UNILATERAL};
    if (!(regular > REDUNDANT * a * c)) {
        return false;
    }
    double first = (b * free[1] - c * free[0]) / regular, second = (b * free[0] - a * free[1]) / regular;
    bool solved = (first >= 0.0 || !opens[0]) && (second >= 0.0 || !opens[1]);
    if (!solved && opens[0]) {
        first = 0.0;
        second = opens[1] ? fmax(-free[1] / c, 0.0) : -free[1] / c;
        solved = free[0] + b * second >= 0.0;
    }
    if (!solved && opens[1]) {
        first = opens[0] ? fmax(-free[0] / a, 0.0) : -free[0] / a;
        second = 0.0;
        solved = free[1] + b * first >= 0.0;
    }
    if (solved) {
        lambda[i] = first;
        lambda[j] = second;
    }
    return solved;
}

static bool rubs_not(const Row *row) {
    return row->law == ROW_UNILATERAL || row->law == ROW_BILATERAL;
}

bool lone_rows(const SparseProblem *problem, int count, const int rows[], double lambda[]) {
    const Row *row = problem->row;
    if (count == 1) {
        return solve_row(problem, rows[0], lambda + rows[0]);
    }
    if (count != 2) {
        return false;
    }
    if (rubs_not(&row[rows[0]]) && rubs_not(&row[rows[1]])) {
        return solve_pair(problem, rows[0], rows[1], lambda);
    }
    const int n = rows[0] < rows[1] ? rows[0] : rows[1];
    return row[n].law == ROW_UNILATERAL && row[n + 1].law == ROW_TANGENTIAL && row[n + 1].normal == n &&
           rows[0] + rows[1] == 2 * n + 1 && solve_contact(problem, n, lambda + n);
}
