/* Rows that stay at rest may share a load in many ways, of which one is chosen. */
#ifndef SHARES_H
#define SHARES_H

#include "laws.h"

/* other[size] becomes the solution of least norm with the same rows at rest and the same sides of friction as x[size],
   which was found under the limits of `found`. Rows of friction that would bear more than their limit bear it, and the
   others what is left. Returns whether other obeys the laws. The arena has room for two full matrices and 20
   vectors. */
bool shares_even(const Laws *laws, const Laws *found, const double x[], double other[]);

/* Of all solutions with the same rows at rest and the same slips, x[size] becomes that of least norm if it obeys the
   laws. Slips in space turn with their loads. */
void shares_spread(const Laws *laws, double x[]);

#endif
