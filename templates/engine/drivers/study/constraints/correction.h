/* How a projection has moved states, and how its result answers to what varies. With W = M^-1 G^T where the projection
   has factorised it, and multipliers L,

       q* = q + W L,  phi(q*, p) = 0:   dq* = dq + dW L + W dL,   G(q*) (dq* - dq) = -(G(q*) dq + phi_p dp),

   and the same for velocities with their constraints. With w = W L, M dW L = d(G^T) L - dM w =: -c, where c is what the
   tangent of the residual at (w, L) has more than at (0, 0). Where the projection has factorised more than once, what
   is left out is of second order in L. Under error control L is as small as the tolerance, and what W changes is left
   out: it would make such steps up to a fifth slower. */
#ifndef CORRECTION_H
#define CORRECTION_H

#include "constraint_residuals.h"

typedef struct {
    Level level;
    double unknowns[N_UNKNOWNS]; /* w and L */
    Values values;               /* at the result, which they led to */
    const double *at;            /* the states where W is */
    bool moved;                  /* does W L count? */
} Correction;

/* Is W of a level that of the states before the projection? That of velocities is, where all rows tell positions. */
static inline bool correction_keeps(Level level) {
    return level == POSITIONS || N_HOLONOMIC == N_CONSTRAINTS;
}

/* The correction of a level at a time (s), from some states to others on the constraints, and the system where W is.
   Returns false, with instance->failure, if that fails. */
bool correction_find(Instance *instance, double time, const double inputs[], const double from[], const double to[],
                     Level level, Correction *correction);

/* How often the system is solved for an answer. Each solution multiplies the error by the change of G from where W is
   to the result, which is of the order of L: three leave the fourth order in L. */
static inline int correction_solutions(const Correction *correction) {
    return correction->moved ? 3 : 1;
}

/* change[n] = dw + W dL for c[n], and rows[of the level]: those of G(q*) dq + phi_p dp. */
void correction_answer(const System *system, const Correction *correction, const double c[], const double rows[],
                       double change[]);

#endif
