/* The equations of a step of a variational method (variational.c), linearized. With the balance (m, F, R, phi, v) of
   momenta at its points, see mechanism_balance_tangent, they read

       m_i = m_0 + h sum_j hat_ij F_j + h sum_l hat_il R_l,     dz/dt at the stage i = its rates,
       m_end = m_0 + h sum_j b_j F_j + h sum_l b_l R_l,         phi_l = 0,   v_end = 0,

   i, j are stages, l nodes. They are G(x, w, p) = 0 for the unknowns w of DirectedMemory, whose derivatives are those
   of an implicit function: dw = -G_w^-1 (G_x dx + G_p dp). Each point adds to the rows of G by couplings, which the way
   back transposes. Griewank, Walther, Evaluating Derivatives, SIAM 2008, section 15.3. */
#ifndef STEP_POINTS_H
#define STEP_POINTS_H

#include "directions.h"

typedef enum { POINT_START, POINT_STAGE, POINT_NODE, POINT_END } PointKind;

typedef struct {
    PointKind kind;
    int place;                 /* of the stage or node */
    double time;               /* s */
    double length;             /* of the step, s */
    double states[N_STATES];
    double multipliers[SIZE_CONSTRAINTS];
    double weights[STAGES];    /* coordinates and further states there, by those rates at the stages */
} StepPoint;

/* What the balance gives at a point, or derivatives of it or by it; rates are those of further states. */
typedef struct {
    double momenta[N_COORDINATES], forces[N_COORDINATES], reactions[N_COORDINATES];
    double positions[SIZE_CONSTRAINTS], velocities[SIZE_CONSTRAINTS];
    double rates[SIZE_FURTHER];
} Balance;

int step_point_count(void);

/* Point i of the step from the present point to scratch.new_states, whose stages are in scratch.solver. */
StepPoint step_point(const Instance *instance, Step step, int i);

/* Adds what a point gives to the rows[SIZE_OF_STEP] of G. With `back` rows[] are derivatives by those rows, and the
   derivatives by what the point gives are added to that. */
void step_couple(const StepPoint *point, Balance *balance, double rows[], bool back);

/* The derivatives of the balance at a point along a seed, its rates untouched. */
void step_tangent(Instance *instance, const StepPoint *point, const Seed *seed, Balance *balance);

/* The unknowns[n + m] at a stage, where the system in scratch is then factorised. Returns false, with
   instance->failure, if there are none. */
bool step_unknowns(Instance *instance, const StepPoint *stage, double unknowns[]);

/* Adds to change[n] that of the forces of what slides at a stage along a seed; the unknowns are those of
   step_unknowns. */
void step_rub(Instance *instance, const StepPoint *stage, const double unknowns[], const Seed *seed, double change[]);

/* The changes of states at a point as the states before the step change: for the rest the unknowns do. */
void step_seed(const StepPoint *point, const double before[], double states[]);

/* Factorises G_w, or its transpose, in the memory of the method. Returns false, with instance->failure, if it has no
   inverse. */
bool step_linearize(Variations *variations, Step step, bool transposed);

#endif
