/* A x = b for a full matrix A of any size, row-major, by L U with row pivoting. Golub, Van Loan, Matrix Computations,
   4th edition, section 3.4. */
#ifndef LU_H
#define LU_H

#include <stdbool.h>

/* Overwrites a[size * size] by its factors, with the inverses of the pivots on the diagonal, and rows[size] by the
   order of its rows. Returns false if a pivot or its inverse is not finite. */
bool lu_factorize(double a[], int rows[], int size);

/* x[size] for b[size], with the factors. */
void lu_solve(const double a[], const int rows[], int size, const double b[], double x[]);

#endif
