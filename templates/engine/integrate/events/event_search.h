/* Where event functions come down to 0 within a trial step, by polynomials through their values on its interpolant. */
#ifndef EVENT_SEARCH_H
#define EVENT_SEARCH_H

#include "roots.h"
#include "solver.h"

/* The descents in a trial step. Places are given by theta, the part of the step's length. */
typedef struct {
    double theta[SIZE_EVENTS];  /* where each event function comes down, NO_ROOT for those that do not */
    bool left_out[SIZE_EVENTS]; /* functions that are not searched, set before */
    int first;                  /* the function that comes down first, -1 if there is none */
    double slope;               /* its slope there by theta */
    double start;               /* its value where the step begins */
    double earliest, latest;    /* theta between which the true root lies, errors of the interpolant included */
} Descents;

/* *far: all event functions are far from 0 on Hermite's cubic of the step, so that no better interpolant has a root.
   Most steps need no further search. start[N_EVENTS] are the functions at the beginning of the step. Returns false,
   with instance->failure, if an evaluation fails. */
bool far_from_events(Instance *instance, Step step, const double start[], bool *far);

/* Finds the first descent in the step of state->dense, which begins with the event functions start[N_EVENTS]. The
   search goes from its beginning, in parts in which the functions are like polynomials. Returns false, with
   instance->failure, if an evaluation fails. Source: Shampine, Thompson, Event location for ordinary differential
   equations, Computers and Mathematics with Applications 39, 2000. */
bool find_descents(Instance *instance, const double start[], Descents *found);

#endif
