/* The parts of adjoint.c that depend on what a mechanism has: each is the transposed map of a function in the headers
   of the variants. Arrays of weights belong to what that function gives; a Seed gets derivatives added. Where a
   mechanism has no such part, *_none.c does what is left. */
#ifndef ADJOINT_PARTS_H
#define ADJOINT_PARTS_H

#include "instance.h"

/* What is kept of weights between the two parts of multipliers_spread_rates. */
typedef struct {
    bool unique;                       /* the multipliers are unique, and the other members are not used */
    double own[SIZE_CONSTRAINTS];      /* weights of the rates that multipliers have with unchanged forces */
    double exchange[N_COORDINATES];    /* weights of the change of forces of the difference of both multipliers */
} Spread;

/* system_answer: change[n + m] are the weights of the residuals for those of the unknowns. */
void system_answer_adjoint(const System *system, const double unknowns[], double change[]);

/* accelerations_stabilise, on weights change[n + m + m + h] of the residuals. */
void accelerations_stabilise_adjoint(const Instance *instance, double change[]);

/* multipliers_spread_rates: changes the weights of the multipliers in unknowns[n + m]. */
void multipliers_spread_adjoint(const Instance *instance, double unknowns[], Spread *spread);

/* The second part of multipliers_spread_adjoint, for which the weights change[n + m] of the residuals are known. These
   were taken with the reported multipliers, but belong to the multipliers of the accelerations. */
void multipliers_spread_knowns(const Instance *instance, const Spread *spread, const double change[],
                               Seed *sensitivity);

/* contacts_answer at the present point: changes the weights unknowns[n + m]. */
void contacts_answer_adjoint(Instance *instance, double unknowns[], Seed *sensitivity);

/* constraints_settle_seed and massless_settle_seed. */
void constraints_settle_adjoint(Instance *instance, Seed *sensitivity);
bool massless_settle_adjoint(Instance *instance, Seed *sensitivity);

#endif
