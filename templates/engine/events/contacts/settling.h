/* Choosing modes at one point: the record of what is known there, and the steps of the choice. */
#ifndef SETTLING_H
#define SETTLING_H

#include "complementarity.h"
#include "contact_modes.h"
#include "linear_solve.h"

/* All K = N_CONSTRAINTS constraints take part, rows that modes switch included, whatever their modes. A touching
   contact has a gap of 0. due and stopping are by event function: 2 i and 2 i + 1 of contact i, 2 N_UNILATERALS + i of
   dry friction i; their last place is unused, because C has no array of length 0.
   only_switched: modes are chosen anew because a switch has turned. Nothing has come to rest, so that what slides and
   is at rest has given way just now. Its acceleration is still 0: it goes on to slide, or else it would stick again,
   give way again, and the switch of its speed would be left on the wrong side. */
typedef struct {
    Instance *instance;
    bool due[2 * N_UNILATERALS + N_FRICTIONS + 1];      /* as contacts_settle says */
    bool stopping[2 * N_UNILATERALS + N_FRICTIONS + 1]; /* a slip along a line that is due */
    bool only_switched;
    ElementRows rows;
    double jacobian[N_CONSTRAINTS * N_COORDINATES];
    double response[N_CONSTRAINTS * N_COORDINATES];   /* row k: M^-1 g_k */
    double delassus[N_CONSTRAINTS * N_CONSTRAINTS];   /* G M^-1 G^T */
    double velocity[N_CONSTRAINTS];
    double free[N_CONSTRAINTS];                       /* accelerations without forces of constraints */
    double restitution[SIZE_UNILATERALS]; /* behind an impact that of the impact, or what Poisson's law returned */
    double friction[SIZE_UNILATERALS], holding[SIZE_UNILATERALS];
    bool permanent[N_CONSTRAINTS];
    bool touching[SIZE_UNILATERALS];
    bool rebounds[SIZE_UNILATERALS];                  /* an impact has just taken place there */
    double overlap[SIZE_UNILATERALS];                 /* of a gap that was due, which has been undone */
    Row row[N_CONSTRAINTS];
    double lambda[N_CONSTRAINTS], w[N_CONSTRAINTS];
    bool determined[N_CONSTRAINTS];                   /* no friction along the row has a lever */
} Settling;

/* Is the gap of the contact due to be 0 here, or 0 by chance? */
bool settling_meets(const Settling *settling, int contact);

/* Brings everything up to date with the present point. Returns false, with instance->failure, where M is
   singular or a coefficient of restitution or friction has no meaning. */
bool settling_measure(Settling *settling);

/* No modes were found: sets instance->failure to the reason, which may be that there was no memory; returns false. */
bool settling_fail(Instance *instance);

/* The speed along a row, m/s or rad/s, up to which it is at rest. */
double settling_least_speed(const Settling *settling, int row);

/* Rebounds of a contact up to this height, in units of its gap, are not followed one by one: the tolerance. In model
   exchange each impact is located inside by the hysteresis of its indicator, and where it is not told when the gap was
   0 (late_impacts.h), undoing the overlap lifts the body by as much. Rebounds of a hundred times that height still lose
   more than this from a restitution of 0.995 downwards; lower ones would go on without end. */
double settling_least_rebound(const Settling *settling, int contact);

/* Is this normal force (N) of a contact more than rounding? One that is would soon move the contact faster than
   settling_least_speed. */
bool settling_bears(const Settling *settling, int contact, double force);

/* states[N_STATES] = the present ones, moved onto the rows that the modes hold. Velocities that are rounding errors
   become 0, so that a body at rest does not creep. Returns false, with instance->failure, if there are no such
   states. */
bool settling_find_states(Settling *settling, double states[]);

/* Makes states[N_STATES] the present ones; *jumped is set if they are others. */
void settling_take(Settling *settling, const double states[], bool *jumped);

/* Finds such states and takes them. */
bool settling_move(Settling *settling, bool *jumped);

/* Brings slips in space that have come to rest to rest, before everything else is decided; *jumped is set if states
   changed. Returns false, with instance->failure, as settling_move does. */
bool settling_stop_in_space(Settling *settling, bool *jumped);

/* The velocity of a row of slip along a line, m/s or rad/s, whose event function is `function`. A velocity that is no
   more than the error of its last location gets the sign of the direction of sliding. */
double settling_slip_located(const Settling *settling, int row, int function);

/* The slip velocity along a row of a contact, in m/s. */
double settling_slip_velocity(const Settling *settling, int contact, int row);

/* The length of the last step of an importer's solver, s; 0 where the instance integrates. */
double settling_last_step(const Instance *instance);

/* The speed of the slip of a contact, in m/s. */
double settling_slip_speed(const Settling *settling, int contact);

/* Closes a contact whose impacts accumulate; it sticks or slides as it moves at present. settling_move then takes its
   normal velocity away. After that forces have to be found once more: those found for the motion before may not keep
   all contacts of a body closed. */
void settling_close(Settling *settling, int contact);

/* direction[slips], of any length: friction on a contact that slides acts against it. */
void settling_slip_direction(const Settling *settling, int contact, double direction[]);

/* led[N_CONSTRAINTS]: the rows of slips in space whose friction looks ahead. directions[N_CONSTRAINTS]: to where the
   forces found in lambda, w lead these slips, along slip + tau w - kappa lambda, as in the motion; 0 in other rows.
   Returns true if a direction differs from that of its rows by more than OBEYED. */
bool settling_lead(const Settling *settling, bool led[], double directions[]);

/* Lets a closed contact slide, stick or wait for a lever, as lambda and w say. */
void settling_carry_out_slip(Settling *settling, int contact);

/* Lets a contact that sticks slide against its friction among the loads[K]. */
void settling_give_way(Settling *settling, int contact, const double loads[]);

/* Impacts: changes velocities until nothing approaches, and latches hold. *jumped is set if velocities changed. */
bool settling_impacts(Settling *settling, bool *jumped);

/* An impact without a collision, where sliding friction leaves no forces that obey the laws: it stops a slip whose
   contact has no more than this lever, see impacts_without_collision. Returns false if there is none. */
bool settling_without_collision(Settling *settling, double most_lever, bool *jumped);

/* Within an impact: loaded[i] becomes true where forces at the present velocities press on a touching contact that does
   not approach. Where no forces obey the laws nothing changes. */
void settling_find_loads(Settling *settling, bool loaded[]);

/* Sets row[], lambda[], w[] and determined[] by the laws at the measured point. Returns false without a solution. */
bool settling_laws(Settling *settling);

/* Chooses which touching contacts stay closed and what sticks, by forces and accelerations; *jumped is set if an impact
   without a collision was needed. Returns false, with instance->failure, if no modes obey the laws. */
bool settling_modes(Settling *settling, bool *jumped);

/* The friction of contacts that slide follows the loads of least norm. Where some of these pull, or some that stick
   beside those that slide do not hold with them, the laws have found another share. Contacts that pull open then,
   though they go on to touch, and those beyond their limit slip, one after the other, until the share of the others
   obeys the laws. Returns false, with instance->failure, where there are no accelerations. C. L. Lawson,
   R. J. Hanson, Solving Least Squares Problems, 1974, section 23.3 (the set of forces above 0). */
bool settling_relieve(Settling *settling);

#endif
