/* Slips along a line whose event is due: of contacts with one direction of sliding, and of dry frictions. */
#ifndef STOPPING_SLIPS_H
#define STOPPING_SLIPS_H

#include "settling.h"

typedef struct {
    double direction[2 * N_UNILATERALS + N_FRICTIONS + 1]; /* in which each slid, by event function; 0 where none is
                                                              due; one more: there may be none */
    bool stopped;     /* friction holds some of them */
    bool within_step; /* friction could have made all their speed in the last step of an importer's solver */
} StoppingSlips;

/* Moves the slips along a line that are due from settling->due to settling->stopping, and notes their directions.
   Returns whether there are any. */
bool slips_find(Settling *settling, StoppingSlips *slips);

/* Takes out the slips that move in their old directions: a contact that has closed at this event has given them other
   velocities than those with which they were due. */
void slips_forget_moving(Settling *settling, StoppingSlips *slips);

/* Lets the slips stick that friction holds by the laws at the measured point. The others pass through 0 and slide in
   the other direction, as a slider does at the dead centre of its crank, where no velocity makes it slip. */
void slips_stop(Settling *settling, StoppingSlips *slips);

/* Lets the slips that slips_stop made stick slide on in the other direction instead. */
void slips_pass(Settling *settling, const StoppingSlips *slips);

#endif
