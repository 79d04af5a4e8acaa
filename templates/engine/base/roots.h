/* Where polynomials on an interval come down to 0. They are given by their values at nodes and kept in Bernstein's
   basis, p(theta) = sum_i b_i C(n, i) theta^i (1 - theta)^(n - i): they have no more roots in (0, 1) than the b_i have
   changes of sign, so that an interval without any is settled at once. Sources: Lane, Riesenfeld, Bounds on a
   polynomial, BIT 21, 1981; Rouillier, Zimmermann, Efficient isolation of polynomial's real roots, Journal of
   Computational and Applied Mathematics 162, 2004. */
#ifndef ROOTS_H
#define ROOTS_H

#include <stdbool.h>

enum { ROOT_DEGREE = 5, ROOT_NODES = ROOT_DEGREE + 1 };

#define NO_ROOT 2.0 /* what is answered where there is none: beyond the interval */

/* The nodes in [0, 1], both ends included: where Chebyshev's polynomial of that degree is greatest. */
extern const double ROOT_PLACES[ROOT_NODES];

/* bernstein[ROOT_NODES] of the polynomial with these values at the nodes. */
void roots_fit(const double values[], double bernstein[]);

/* Is the polynomial of these values clearly all that is in them? If not, a shorter interval is needed. */
bool roots_resolved(const double values[]);

/* The slope of the polynomial at theta. */
double roots_slope(const double bernstein[ROOT_NODES], double theta);

/* The least theta in [0, 1] where the polynomial comes down: from positive to not positive. A value up
   to the noise counts as 0 at theta = 0. A polynomial that is below 0 there, or falls from 0, comes down at theta = 0.
   NO_ROOT if it does not come down, or stays within the noise. */
double roots_first_descent(const double bernstein[ROOT_NODES], double noise);

#endif
