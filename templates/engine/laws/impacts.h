/* Impacts: impulses P along the rows of a Delassus operator, velocities after = velocities before + delassus P.
   SIZE_ROWS, SIZE_ACTIVE and SIZE_CONTACTS of mechanism.h are the largest numbers of rows, of rows of contacts and of
   contacts, each at least 1.
   Newton's law for normal velocities, Coulomb's between impulses: Moreau, Unilateral contact and dry friction in finite
   freedom dynamics, in Nonsmooth Mechanics and Applications, 1988; Glocker, Set-Valued Force Laws, 2001. */
#ifndef IMPACTS_H
#define IMPACTS_H

#include <stdbool.h>

#include "contact_rows.h"
#include "mechanism.h"

typedef enum {
    /* Round after round: those contacts take part that approach, with their restitution, and those under load that are
       at rest, with restitution 0. It ends when none approaches, and earlier where a contact has come to rest by its
       impulse: the caller says whether it is under load from there on. Bilateral rows hold in each round; if they move
       before, there is at least one. */
    IMPACTS_SEQUENTIAL,
    /* One complementarity problem over all contacts that touch: velocity after + restitution * velocity before, where
       that was an approach, is complementary to the impulse. */
    IMPACTS_SIMULTANEOUS
} ImpactOrder;

/* A contact that touches. */
typedef struct {
    int normal;         /* its row: the velocity of the gap */
    int slip;           /* its first row of slip */
    int slips;          /* the number of its rows of slip, which are consecutive: 0, 1 or 2 */
    double restitution; /* 0 to 1 */
    double friction;    /* >= 0: of sliding */
    bool loaded;        /* bears a force at the present velocities */
    double slow;        /* >= 0: normal velocities up to this one count as rest */
} ImpactContact;

typedef struct {
    Arena *arena; /* for the work of solving it */
    int rows;
    const double *delassus;   /* [rows * rows], row-major, symmetric, positive semidefinite */
    const double *velocities; /* [rows], before */
    const bool *bilateral;    /* [rows]: the velocity after is 0; other rows that are of no contact bear no impulse */
    int contacts;
    const ImpactContact *contact; /* [contacts] */
    bool one_round;               /* restitution holds for a round of sequential impacts: there is no other in a call */
} ImpactProblem;

typedef struct {
    double impulses[SIZE_ROWS];   /* of all rounds together, those of earlier calls included; likewise below */
    double velocities[SIZE_ROWS]; /* after */
    int counts[SIZE_CONTACTS];    /* in how many rounds a contact collided */
    int rounds;
    double lost;  /* kinetic energy before - after, >= 0 but for rounding */
    bool poisson; /* with Newton's law the kinetic energy would grow, or there is no solution: Poisson's was taken */
    bool reduced; /* with Poisson's law it would grow, too: the restitution was reduced until it did not */
    bool closed;  /* the rounds did not end and were closed without restitution */
} ImpactResult;

/* Resolves an impact, or goes on with it: *result is that of the earlier calls, zeros in the first one. False: there is
   no memory, as problem->arena tells, or no solution, as between bodies whose motions are all prescribed. */
bool impacts_solve(const ImpactProblem *problem, ImpactOrder order, ImpactResult *result);

/* The problem from these velocities[rows] on, with rows[rows] that bear no impulse but bilateral ones. */
Problem impacts_describe(const ImpactProblem *problem, const double velocities[], Row rows[]);

/* Adds a contact that takes part, with this least normal impulse. */
void impacts_add(const ImpactContact *contact, double least, Row rows[]);

#endif
