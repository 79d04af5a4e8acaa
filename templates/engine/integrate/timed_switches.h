/* Switches that depend on nothing but the time and parameters; timed_none.c is for mechanisms without them. */
#ifndef TIMED_SWITCHES_H
#define TIMED_SWITCHES_H

#include "instance.h"

typedef struct {
    double roots[SIZE_SWITCHES];  /* s; HUGE_VAL for a switch that does not turn */
    double slopes[SIZE_SWITCHES]; /* 1/s; of the margins there, negative on the side of the switch */
    int first;                    /* the switch that turns first, -1 if none does */
    double known;                 /* s; up to this time no other one turns */
} TimedRoots;

/* Looks for the first time in [from, to] (s) at which one of these switches turns under the present modes. No root is
   missed, however near to the next one it is, because interval arithmetic bounds the margins and their slopes between
   any two times. If this takes too many parts of the time, the search ends with found->known before `to`. Returns
   false, with instance->failure, if a margin has no finite value. Source: R. E. Moore, R. B. Kearfott, M. J. Cloud,
   Introduction to Interval Analysis, SIAM 2009, chapter 8. */
bool timed_first(Instance *instance, double from, double to, TimedRoots *found);

/* The next time (s) at which one of these switches turns, so that an importer's solver goes just so far; HUGE_VAL if
   there is none before the experiment ends. If the search takes too long, a time at which nothing happens, from which
   it goes on. */
double timed_next(Instance *instance);

#endif
