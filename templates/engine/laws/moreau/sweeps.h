/* Gauss-Seidel sweeps over rows and cones: cheap steps of many rows towards a solution. */
#ifndef SWEEPS_H
#define SWEEPS_H

#include "laws.h"

/* Each row and cone in turn takes the nearest x that its law allows to x - w / curvature; x[size] and w[size], which
   belongs to it, obey all limits then. */
void sweep(const Laws *laws, double x[], double w[]);

/* `sweeps` sweeps, whose changes of x are taken for gradients of the method of Fletcher and Reeves, and a plain one:
   Silcowitz-Hansen, Niebe, Erleben, A nonsmooth nonlinear conjugate gradient method for interactive contact force
   problems, Visual Computer 2010. False: there is no memory, as laws->arena tells. */
bool sweeps_descend(const Laws *laws, int sweeps, double x[]);

/* By how much a step of all rows at once would move x beyond rounding errors, relative to the greatest offset; *moved
   is the same, with rounding errors, relative to x. Sets w[size]. */
double sweeps_residual(const Laws *laws, const double x[], double w[], double *moved);

#endif
