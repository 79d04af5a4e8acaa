/* A group of lanes: each lane integrates one run after the other, so that all of them stay full. What a lane computes
   depends on its own run alone: neither on its neighbours nor on when the run began. */
#ifndef LANE_GROUP_H
#define LANE_GROUP_H

#include "batch.h"
#include "lane_tableau.h"
#include "lanes.h"

enum { NO_RUN = -1, HERMITE_TERMS = 3, DENSE_TERMS = HERMITE_TERMS + DENSE_ROWS };

typedef struct {
    const Batch *batch;
    int64_t run[LANES];      /* NO_RUN: the lane is idle */
    int64_t sample[LANES];   /* the number of the next sample */
    int64_t knot[LANES];     /* the number of the knot of the inputs that was passed last */
    Lanes next_sample;       /* s; the time of the next sample, HUGE_VAL behind the last one */
    Mask trials, accepted;   /* counts of solver steps: of those tried, and of those accepted */
    Mask active;             /* the lane has a run */
    Mask stale;              /* the lane needs its first stage anew */
    Mask fresh;              /* the run begins, and needs its first step */
    Mask lost;               /* the formulas do not hold in the lane: its run leaves it */
    Mask rejected;           /* the last trial step was rejected */
    Lanes time, stop, limit; /* s; the limit is where steps have to end next: a knot, or the stop time */
    Lanes next_step, longest, previous_log_error;
    Lanes begin, count, done; /* equal steps: where they began (s), how many there are, how many are done */
    Lanes parameters[SIZE_PARAMETERS];
    Lanes knot_time, knot_inputs[SIZE_SIGNALS], slopes[SIZE_SIGNALS];
    Lanes states[N_STATES];
    Lanes stages[ALL_STAGES][N_STATES];
    Lanes squares[SIZE_CONSTRAINTS];     /* the least squared distances of constraints with which formulas hold */
    Lanes least_pivots[N_COORDINATES];
    Lanes at_end[N_QUANTITIES];          /* the quantities at the end of the last step, if zeros are looked for */
    Memory memory; /* what the method remembers, see lane_tableau.h */
    Lanes length, end; /* s; the trial step: its length, and the time where it ends */
    Lanes new_states[N_STATES], new_derivatives[N_STATES];
    Lanes dense[DENSE_TERMS][N_STATES];
} Group;

/* f = dx/dt at a time (s) and states in the lanes of a mask, with all unknowns. Lanes in which the formulas do not hold
   become lost. */
void group_derivative(Group *group, Mask mask, Lanes time, const Lanes states[], Lanes unknowns[], Lanes derivatives[]);

/* The inputs at a time (s). */
void group_inputs(const Group *group, Lanes time, Lanes inputs[]);

/* Gives idle lanes the next runs that wait. */
void group_fill(Group *group);

/* Ends the runs in the lanes of a mask with this status. */
void group_end_runs(Group *group, Mask mask, int64_t status);

/* Puts the limit of the lane's steps, and the inputs up to it. */
void group_limit(Group *group, int lane);

/* Moves states at a time (s) onto the constraints, in the lanes of a mask; returns where they were moved. Lanes where
   that fails become lost. */
Mask group_project(Group *group, Mask mask, Lanes time, Lanes states[]);

/* The squares of distances at the start, from which their least values follow. */
void group_begin_constraints(Group *group, Mask mask);

/* The method, in lane_runge_kutta.c or lane_variational.c: makes the trial step in all active lanes, into new_states
   and new_derivatives. Returns its errors in units of the tolerance, 0 for steps of fixed length, and NaN in lanes
   with a state that is not a number. */
Lanes method_try(Group *group);

/* Sets the terms of the method's interpolant beyond Hermite's cubic, in the lanes of a mask. */
void method_dense(Group *group, Mask mask);

/* Begins the method's memory anew, at a point that is new to it, in the lanes of a mask. */
void method_begin(Group *group, Mask mask);

/* Prepares the interpolant of the trial step (as in dense_output.h of the engine); the mask says which lanes use
   it. */
void group_dense(Group *group, Mask mask);

/* Records what was asked for, after a step from group->time to group->end was accepted in the lanes of a mask. */
void group_record_step(Group *group, Mask mask);

/* Records the values at the start, which is the present time: extremes, and samples that are due. */
void group_record_start(Group *group, Mask mask);

/* Records the values at the end of the runs in the lanes of a mask. */
void group_record_end(Group *group, Mask mask);

/* One trial step in all lanes that are active. */
void group_step(Group *group);

/* Chooses the length of the first step in the lanes of a mask. */
void group_first_step(Group *group, Mask mask);

#endif
