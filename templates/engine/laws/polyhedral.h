/* Laws whose solutions are piecewise linear. */
#ifndef POLYHEDRAL_H
#define POLYHEDRAL_H

#include "laws.h"

/* Solves laws without contacts in space; x[size]. False: no solution was found. */
bool polyhedral_solve(const Laws *laws, double x[]);

/* A row that moves otherwise in another solution than x[size]; -1 if no other choice of equations has one, or if there
   are too many to try. */
int polyhedral_other(const Laws *laws, const double x[]);

/* Solves a problem in which pyramids with four sides stand for round cones; x[size], as far as that goes. False: there
   is no memory for it, which laws->arena tells. */
bool polyhedral_approximate(const Laws *laws, double x[]);

#endif
