/* Derivatives of a motion along directions in the space of starts, inputs and parameters: the variational equations

       dS/dt = f_x S + f_u du + f_p dp,   S = dx/dtheta,

   integrated with the motion. Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, 2nd edition, section
   I.14. They are taken through every stage of the solver, so that they are the derivatives of the very numbers that the
   method gives for the steps it took (internal differentiation: Bock, 1981). */
#ifndef DIRECTIONS_H
#define DIRECTIONS_H

#include "dense_output.h"
#include "directed_memory.h"
#include "integrator.h"
#include "study.h"

enum { N_JUMPING = N_STATES + N_MASKS }; /* the states, and what modes remember beside them: places that latches hold */

typedef struct {
    double scale;            /* a typical size of what is varied, which weighs the errors */
    Seed seed;               /* what varies of inputs and parameters; states: S at the point that is evaluated */
    double rates[N_STATES];  /* dS/dt at that point, the result of an evaluation */
    double states[N_STATES]; /* S at the present point */
    double slope[N_STATES];  /* dS/dt there */
    double stages[STAGES][N_STATES];
    double new_states[N_STATES]; /* at the end of a trial step */
    double new_slope[N_STATES];
    double unprojected[N_COORDINATES]; /* of the positions, while they are projected */
    double shift; /* s; by how much the event at the present point moves */
    Dense dense;
} Direction;

typedef struct {
    Study study;
    Instance probe, before; /* for looking at other points: an instance beside the motion, and that before an event */
    const Request *request;
    int next; /* the sample that comes */
    int count;
    void *tape; /* that records the run, if one does */
    DirectedMemory method;
    Direction directions[];
} Variations;

/* The rates of all directions at a time (s) and states, for S in their seeds. */
bool directions_evaluate(Variations *variations, double time, const double states[]);

/* Takes S in the seeds through a projection at a time (s): from S of the states `from` to that of the states `to`. */
bool directions_project(Variations *variations, double time, const double from[], const double to[]);

/* S and its slope at the present point become those in the seeds, on the constraints. */
bool directions_settle(Variations *variations);

/* S at the solved start of an instance, on its constraints, from what is varied. */
bool directions_stand(Variations *variations, Instance *instance);

/* S at a start from which something touches, rubs or is latched, for S of the start before it (landing.c). */
bool directions_land(Variations *variations);

/* S at the solved start, and the modes that hold there; S jumps at impacts (jumps.c). */
bool directions_start(Variations *variations);

/* The rounding error of a direction in a trial step, in nominal states. Of a direction that is much longer than its
   scale, as that of a torque of 1 N.m on a toy, it is more than tight tolerances allow; and so it is just before a slip
   in space comes to rest. */
double direction_rounding(Variations *variations, const Direction *direction);

/* Passes the event at the present point: S jumps (jumps.c). */
bool directions_pass(Variations *variations);

/* Do inputs that changed make states jump, or a latch catch? It is not passed yet. */
bool directions_due(Variations *variations);

/* Steps to the end (s), with samples at the times asked for; those at the end are left. */
bool directions_integrate(Variations *variations, double end);

/* Goes in stretches between knots of the inputs to the last time, and samples where they end. */
bool study_stretches(Variations *variations, bool (*integrate)(Variations *variations, double end),
                     bool (*sample)(Variations *variations));

/* The start and how it answers to the directions; then the modes that hold there. */
bool directions_begin(Variations *variations);

/* At the beginning of a stretch, to the end (s). `with` passes the events that changed inputs have made due. */
bool directions_begin_stretch(Variations *variations, double end, const Companion *with);

/* In the solver's steps to that end (s), which `with` goes through too. */
bool directions_step(Variations *variations, double end, const Companion *with);

/* The probe comes to a time (s) and states, on the constraints. */
bool directions_look(Variations *variations, double time, const double states[]);

/* Values and derivatives for the next sample at a time (s), with the states there and S in the seeds. */
bool directions_sample(Variations *variations, double time, const double states[]);

#endif
