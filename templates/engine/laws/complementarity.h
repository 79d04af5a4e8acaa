/* Solves the laws of contacts and dry friction between the rows of a Delassus operator. Matrices are as large as the
   rows that are not free. Sources: Pfeiffer, Glocker, Multibody Dynamics with Unilateral Contacts, 1996; Acary,
   Cadoux, Lemarechal, Malick, A formulation of the linear discrete Coulomb friction problem via convex optimization,
   ZAMM 2011. */
#ifndef COMPLEMENTARITY_H
#define COMPLEMENTARITY_H

#include <stdbool.h>

#include "contact_rows.h"

/* Solves for lambda[rows] and w[rows] to rounding. Where w has to be 0 it is exactly 0, but for bilateral rows that
   contradict each other. Where rows are redundant, bilateral rows get multipliers of least norm, in units of rows whose
   diagonal entry is 1, and so do unilateral and tangential rows if that obeys their laws; where some slide they share
   the load as rows that give way alike do. Equal problems give equal results, on ties
   the order of the rows decides.
   False: there is no solution (Painleve's paradox; never without sliding rows as long as free belongs to a motion),
   none was found, or there is no memory, as problem->arena tells. */
bool complementarity_solve(const Problem *problem, double lambda[], double w[]);

/* Is there another solution with another motion, as sliding friction allows (Painleve's paradox), or friction that an
   impact has caught and that wedges a body in? Returns a row that moves otherwise; -1 if there is none, or with sliding
   rows beside contacts in space that stick, or too many contacts to try. */
int complementarity_other(const Problem *problem);

#endif
