/* Laws with round friction cones. */
#ifndef CONES_H
#define CONES_H

#include "laws.h"

/* The solution x[size] that the convex program leads to, which rests if there is any way to rest. False: it leads to
   none, or there is no memory, which laws->arena tells. */
bool cones_rest(const Laws *laws, double x[]);

/* The solution x[size] that a path of Coulomb's law leads to. False as above. */
bool cones_slide(const Laws *laws, double x[]);

/* Solves any laws whose matrix has all entries; x[size]. False: no solution was found, or there is no memory, which
   laws->arena tells. */
bool cones_solve(const Laws *laws, double x[]);

#endif
