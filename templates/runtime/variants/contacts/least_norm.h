/* Small dense linear equations that may be singular. */
#ifndef LEAST_NORM_H
#define LEAST_NORM_H

/* The solution x[n] of least norm of a x = b in the sense of least squares; a[n * n] is row-major, n <= SIZE_ROWS, its
   entries are of the order of 1. Singular values below a fixed part of the largest one count as 0. Method: one-sided
   Jacobi rotations, which find small singular values to high relative accuracy (Hestenes, Inversion of matrices by
   biorthogonalization and related results, J. SIAM 1958; Golub, Van Loan, Matrix Computations, 4th edition, 8.6.3). */
void least_norm_solve(int n, const double a[], const double b[], double x[]);

#endif
