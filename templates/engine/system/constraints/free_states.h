/* Which states may move while start values are solved for. */
#ifndef FREE_STATES_H
#define FREE_STATES_H

#include "constraint_residuals.h"

/* Those of the level that are guesses, or all of the level. */
typedef enum { GUESSES, ALL_STATES } Freedom;

/* The constraints of the level as a function of the states that are free, in nominal values; damped as
   constraints_factorize says. Multipliers that solve it make the change of least norm. */
void start_factorize(Arena *arena, ConstraintFactorization *work, const double jacobian[], Level level, Freedom freedom,
                     double damping);

#endif
