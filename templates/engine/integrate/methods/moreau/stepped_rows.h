/* Time stepping sees each row through the entries of G that are not 0 by structure, so that its cost grows with the
   active rows and not with their square. */
#ifndef STEPPED_ROWS_H
#define STEPPED_ROWS_H

#include "element_rows.h"
#include "solver.h"

/* The first row of dry frictions and of latches. */
enum { FIRST_DRY_ROW = N_CONSTRAINTS - N_FRICTIONS - N_LATCHES, FIRST_LATCH_ROW = N_CONSTRAINTS - N_LATCHES };

/* Evaluates the rows at a time (s) and states, and also forces, and M + half D factorised, in scratch.system: half (s)
   is half the length of the step, D the matrix of linear dampers. Returns false, with instance->failure, if M is
   singular. */
bool stepped_measure(Instance *instance, double time, double half, const double states[], SteppedRows *at);

/* Evaluates the positions of the rows, and all of permanent constraints. */
void stepped_place(Instance *instance, double time, const double states[], SteppedRows *at);

/* Evaluates permanent constraints alone. */
void stepped_hold(Instance *instance, double time, const double states[], SteppedRows *at);

/* Evaluates the forces alone, in scratch.system, for other velocities than those of stepped_measure. Linear dampers,
   which the factors take to the middle of the step, pull as they did there. */
void stepped_force(Instance *instance, double time, const double states[]);

/* The same for the derivatives of further states, as further_rates. */
bool stepped_further(Instance *instance, double time, const double states[], const double unknowns[], double rates[]);

/* accelerations[n] without forces of rows, by what stepped_measure found. */
void stepped_accelerate(const Instance *instance, double accelerations[]);

/* G_row . vector[n]. */
double stepped_along(const SteppedRows *at, int row, const double vector[]);

/* Numbers these rows in order. */
void rows_number(RowsMet *met, const bool which[]);

/* The Delassus operator of the active rows, scratch.solver.met, from M as it was factorised in scratch.system. */
void stepped_meet(Instance *instance);

/* changes[n] = M^-1 G^T impulses of all rows, of which those are 0 that did not take part in stepped_meet. */
void stepped_respond(const Instance *instance, const double impulses[], double changes[]);

#endif
