/* L D L^T without pivoting for the mass matrix as it should be, scaled Gaussian elimination with full pivoting for the
   rest. Golub and Van Loan, Matrix Computations, 4th edition, sections 4.1 and 3.4. */
#include "linear_solve.h"

#include <float.h>
#include <math.h>

#include "scale.h"
#include "sizes.h"

/* Row by row: w_ij = M_ij - sum_k<j w_ik L_jk, L_ij = w_ij / d_j, d_i = M_ii - sum_j w_ij L_ij. All inner loops run
   along rows. Returns false at the first pivot d_i that is not clearly positive against M_ii. */
static bool factorize_positive(const double mass[], double factor[]) {
    for (int i = 0; i < N; i++) {
        double *row = factor + i * N;
        double pivot = mass[i * N + i];
        for (int j = 0; j < i; j++) {
            const double *other = factor + j * N;
            double w = mass[i * N + j];
            for (int k = 0; k < j; k++) {
                w -= row[k] * other[k];
            }
            row[j] = w; /* divided by d_j below, when row i is complete */
        }
        for (int j = 0; j < i; j++) {
            const double w = row[j];
            row[j] = w / factor[j * N + j];
            pivot -= w * row[j];
        }
        if (!(pivot > PIVOT_ZERO * fabs(mass[i * N + i]))) {
            return false;
        }
        row[i] = pivot;
    }
    return true;
}

/* M_ij, of which the lower triangle is stored. */
static double entry_of_mass(const double mass[], int i, int j) {
    return j <= i ? mass[i * N + j] : mass[j * N + i];
}

/* Flags the rows with entries that are not finite; returns whether there are none. */
static bool mass_is_finite(const double mass[], bool concerned[]) {
    bool finite = true;
    for (int i = 0; i < N; i++) {
        concerned[i] = false;
        for (int j = 0; j < N; j++) {
            concerned[i] = concerned[i] || !isfinite(entry_of_mass(mass, i, j));
        }
        finite = finite && !concerned[i];
    }
    return finite;
}

/* Fills the full matrix S M S, S = diag(1 / sqrt |M_ii|), so that units do not matter to the choice of pivots. A row
   without diagonal is scaled so that its largest entry becomes 1. */
static void scale_symmetrically(const double mass[], Factorization *result) {
    double *scale = result->scale;
    for (int i = 0; i < N; i++) {
        scale[i] = mass[i * N + i] != 0.0 ? 1.0 / sqrt(fabs(mass[i * N + i])) : 1.0;
    }
    for (int i = 0; i < N; i++) {
        double largest = 0.0;
        for (int j = 0; j < N && mass[i * N + i] == 0.0; j++) {
            largest = fmax(largest, fabs(entry_of_mass(mass, i, j)) * (j != i ? scale[j] : 1.0));
        }
        scale[i] = largest > 0.0 ? 1.0 / largest : scale[i];
    }
    for (int i = 0; i < N; i++) {
        for (int j = 0; j < N; j++) {
            result->factor[i * N + j] = entry_of_mass(mass, i, j) * scale[i] * scale[j];
        }
    }
}

/* Brings the largest remaining entry of step k to the diagonal, by exchanging whole rows and columns of the factor;
   returns its magnitude. */
static double bring_pivot(Factorization *result, int k) {
    double *a = result->factor;
    int best_row = k;
    int best_column = k;
    for (int i = k; i < N; i++) {
        for (int j = k; j < N; j++) {
            if (fabs(a[i * N + j]) > fabs(a[best_row * N + best_column])) {
                best_row = i;
                best_column = j;
            }
        }
    }
    for (int j = 0; j < N; j++) {
        const double swapped = a[k * N + j];
        a[k * N + j] = a[best_row * N + j];
        a[best_row * N + j] = swapped;
    }
    for (int i = 0; i < N; i++) {
        const double swapped = a[i * N + k];
        a[i * N + k] = a[i * N + best_column];
        a[i * N + best_column] = swapped;
    }
    const int row = result->row[k];
    const int column = result->column[k];
    result->row[k] = result->row[best_row];
    result->row[best_row] = row;
    result->column[k] = result->column[best_column];
    result->column[best_column] = column;
    return fabs(a[k * N + k]);
}

/* With rank pivots found, the null space of U has a basis vector for each remaining column j: 1 there, and -U11^-1 U1j
   in the columns before. Flags the coordinates that take part in one. It is formed in the place of the scale, which is
   of no more use. */
static void flag_null_space(Factorization *result, int rank, bool concerned[]) {
    const double *a = result->factor;
    for (int j = rank; j < N; j++) {
        double *z = result->scale;
        concerned[result->column[j]] = true;
        for (int i = rank - 1; i >= 0; i--) {
            z[i] = a[i * N + j];
            for (int k = i + 1; k < rank; k++) {
                z[i] -= a[i * N + k] * z[k];
            }
            z[i] /= a[i * N + i];
            concerned[result->column[i]] = concerned[result->column[i]] || fabs(z[i]) > sqrt(DBL_EPSILON);
        }
    }
}

/* The cold path: full pivoting also takes symmetric matrices that are not positive definite. A matrix is singular that
   has a pivot below the largest one times zero. */
static MassOutcome factorize_pivoted(const double mass[], double zero, Factorization *result, bool concerned[]) {
    double *a = result->factor;
    double largest = 0.0;
    if (!mass_is_finite(mass, concerned)) {
        return MASS_NOT_FINITE;
    }
    scale_symmetrically(mass, result);
    for (int i = 0; i < N; i++) {
        result->row[i] = i;
        result->column[i] = i;
    }
    for (int k = 0; k < N; k++) {
        const double pivot = bring_pivot(result, k);
        largest = k == 0 ? pivot : largest;
        if (!(pivot > zero * largest)) {
            flag_null_space(result, k, concerned);
            return MASS_SINGULAR;
        }
        for (int i = k + 1; i < N; i++) {
            const double multiplier = a[i * N + k] / a[k * N + k];
            a[i * N + k] = multiplier;
            for (int j = k + 1; j < N; j++) {
                a[i * N + j] -= multiplier * a[k * N + j];
            }
        }
    }
    return MASS_REGULAR;
}

MassOutcome mass_factorize(const double mass[], Factorization *result, bool concerned[]) {
    result->pivoted = !factorize_positive(mass, result->factor);
    return result->pivoted ? factorize_pivoted(mass, PIVOT_ZERO, result, concerned) : MASS_REGULAR;
}

bool mass_nearly_singular(const double mass[], double part, Factorization *work, bool concerned[]) {
    return factorize_pivoted(mass, part, work, concerned) == MASS_SINGULAR;
}

/* Solves with L D L^T: forward, diagonal, backward. */
static void solve_positive(const double factor[], double b[]) {
    for (int i = 0; i < N; i++) {
        for (int j = 0; j < i; j++) {
            b[i] -= factor[i * N + j] * b[j];
        }
    }
    for (int i = 0; i < N; i++) {
        b[i] /= factor[i * N + i];
    }
    for (int i = N - 1; i > 0; i--) {
        for (int j = 0; j < i; j++) {
            b[j] -= factor[i * N + j] * b[i];
        }
    }
}

/* Solves with P S M S Q = L U: a = S Q U^-1 L^-1 P S b. */
static void solve_pivoted(const Factorization *factorization, double b[], double z[]) {
    const double *a = factorization->factor;
    for (int i = 0; i < N; i++) {
        z[i] = b[factorization->row[i]] * factorization->scale[factorization->row[i]];
        for (int j = 0; j < i; j++) {
            z[i] -= a[i * N + j] * z[j];
        }
    }
    for (int i = N - 1; i >= 0; i--) {
        for (int j = i + 1; j < N; j++) {
            z[i] -= a[i * N + j] * z[j];
        }
        z[i] /= a[i * N + i];
    }
    for (int i = 0; i < N; i++) {
        b[factorization->column[i]] = z[i] * factorization->scale[factorization->column[i]];
    }
}

void mass_solve(const Factorization *factorization, double b[], double work[]) {
    if (factorization->pivoted) {
        solve_pivoted(factorization, b, work);
    } else {
        solve_positive(factorization->factor, b);
    }
}
