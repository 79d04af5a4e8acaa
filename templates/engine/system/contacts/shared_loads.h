/* Contacts whose rows are redundant share their load in many ways that give the same motion. Chooses the way that is
   shown, and tells when no way is left that obeys the laws. */
#ifndef SHARED_LOADS_H
#define SHARED_LOADS_H

#include "contact_modes.h"

/* What may be shared: holding[N_UNILATERALS] are the coefficients of sticking, capacity[N_FRICTIONS] the greatest
   forces of dry friction that sticks, to which a unit of the multiplier k adds bears[friction * m + k]. The margin of a
   contact that sticks is holding N - |T|, of another one N, and that of dry friction its capacity less its force.
   Margins and norms are in units of the scaled rows. */
typedef struct {
    Arena *arena; /* for the work of sharing; arena->refused tells that there was no memory, and nothing was shared */
    const State *state;
    const ConstraintFactorization *constraints;
    const double *holding, *capacity;
    const double *bears; /* NULL: capacities do not depend on loads */
} Sharing;

/* multipliers[m] become, of all with the same forces G^T multipliers, those of least norm whose margins are not
   negative. They stay where there are none, and where a contact slides whose friction would change. */
void loads_obey(const Sharing *sharing, double multipliers[]);

/* multipliers[m] become, of all with the same forces, those whose least margin is greatest; it is negative where none
   obey the laws. Where several have the same least margin, the next one is made greatest, and so on: such margins are
   unique, and move steadily with time. Returns the margin, in units of the scaled rows, beyond which none is made
   greater; HUGE_VAL where nothing is shared. Source: Schmeidler, The nucleolus of a characteristic function game, SIAM
   J. Appl. Math. 17, 1969. */
double loads_centre(const Sharing *sharing, double multipliers[]);

/* multipliers[m] become, of all with the same forces, those of least norm. Returns whether all margins are wide. */
bool loads_least(const Sharing *sharing, double multipliers[]);

#endif
