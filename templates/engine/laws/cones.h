/* Laws with round friction cones. */
#ifndef CONES_H
#define CONES_H

#include "laws.h"

/* Solves any laws; x[size]. False: no solution was found, or there is no memory, which laws->arena tells. */
bool cones_solve(const Laws *laws, double x[]);

#endif
