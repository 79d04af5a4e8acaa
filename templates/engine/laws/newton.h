/* Where the solution of the laws is nearly known. */
#ifndef NEWTON_H
#define NEWTON_H

#include "laws.h"

/* x[size] that obeys the laws, from the start[size] near it. False: Newton's method does not lead to one, or there is
   no memory for it, which laws->arena tells. */
bool newton_solve(const Laws *laws, const double start[], double x[]);

#endif
