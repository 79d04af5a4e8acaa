/* Laws without contacts in space have one of finitely many choices of equations. */
#ifndef CHOICES_H
#define CHOICES_H

#include "laws.h"

/* How many there are; infinitely many with contacts in space, which slide in any direction. */
double choices_count(const Laws *laws);

/* The first choice whose solution x[size] obeys the laws, contacts that open before those that close; with known
   accelerations w[size], that of another motion. Without (NULL) those go first that rows can share by least norm: where
   rows slide, a share decides on the motion. False: there is none, or no memory. The laws have no contacts in space. */
bool choices_solve(const Laws *laws, const double known[], double x[]);

/* A row that moves otherwise in another solution than x[size]; -1 if no other choice of equations has one, or if there
   are too many to try. */
int choices_other(const Laws *laws, const double x[]);

#endif
