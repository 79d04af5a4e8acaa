/* The impulses of one time step: Newton's law of impact and Coulomb's law between impulses, all contacts at once. Jean,
   The non-smooth contact dynamics method, Comput. Methods Appl. Mech. Eng. 177, 1999; Acary, Brogliato, Numerical
   Methods for Nonsmooth Dynamical Systems, 2008, chapter 10. */
#ifndef STEP_IMPULSES_H
#define STEP_IMPULSES_H

#include "stepped_rows.h"

/* The problem of the chosen rows of scratch.solver, with its Delassus operator and without laws. */
void choose_rows(SolverScratch *scratch, const bool which[]);

/* Finds pushes[m] of the chosen rows, 0 of others, and changes[n] of the coordinates that follow: with them needs[m]
   along the chosen rows become 0, or obey their laws. */
void undo_chosen(Instance *instance, const double needs[], double pushes[], double changes[]);

/* Finds who takes part in a step of this length (s) and with which coefficients, in scratch.solver; time and states are
   those where it was measured. Returns false, with instance->failure, if a coefficient of restitution is not between 0
   and 1. */
bool step_begin(Instance *instance, double time, const double states[], double length);

/* Finds coefficients of friction. Returns false, with instance->failure, if one of a contact that touches is
   negative. */
bool step_coefficients(Instance *instance, double time, const double states[]);

/* Finds the impulses and the velocities after, in scratch.solver, for the accelerations there. Returns false, with
   instance->failure, if there is no solution. */
bool step_impulses(Instance *instance, double time, const double states[], double length);

/* unknowns[n + m] of impulses over a step, with accelerations of 0. */
void unknowns_of(const double impulses[], double length, double unknowns[]);

/* Is the velocity along a row after the step as good as 0? */
bool step_stops(const SolverScratch *scratch, int row);

/* Does this contact collide in the step? */
bool step_collides(const Instance *instance, int contact);

#endif
