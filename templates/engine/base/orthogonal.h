/* Orthogonal transformations by Householder's reflections I - v v^T with |v|^2 = 2. G. H. Golub, C. F. Van Loan, Matrix
   Computations, 4th edition, section 5.1. */
#ifndef ORTHOGONAL_H
#define ORTHOGONAL_H

/* The matrix a[rows][columns], with no more rows than columns, becomes the lower triangular L with L L^T = a a^T, whose
   diagonal is not negative; zeros stand on its right. */
void lower_triangular(int rows, int columns, double a[]);

/* Reflects a[rows][columns], row by row, so that a = [L 0] Q^T with a lower triangular L. Rows of unit length that lie
   in the span of those before them are left out: *kept are the indices of the others, whose number is returned, and
   reflectors[number][columns] make Q. */
int reduce_rows(int rows, int columns, double a[], double reflectors[], int kept[]);

/* x becomes Q x. */
void turn_back(int count, int columns, const double reflectors[], double x[]);

#endif
