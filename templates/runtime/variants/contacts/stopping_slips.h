/* Slips along a line whose event is due: of contacts with one direction of sliding, and of dry frictions. */
#ifndef STOPPING_SLIPS_H
#define STOPPING_SLIPS_H

#include "settling.h"

/* The direction in which each of them slid, by event function; 0 where none stops. */
typedef struct {
    double direction[2 * N_UNILATERALS + N_FRICTIONS + 1]; /* one more: there may be none */
} StoppingSlips;

/* Those that are due stick from now on, and are no longer due. Returns whether there are any. */
bool slips_stop(Settling *settling, StoppingSlips *slips);

/* Those that stuck by slips_stop slide on in the other direction instead. What their velocity is on the wrong side of 0
   is noted as an error of the location. */
void slips_pass(Settling *settling, const StoppingSlips *slips);

/* The velocity of a row of slip along a line, with its event function. One that is no more than the error of its last
   location has the direction that it slides in. */
double slip_located(const Settling *settling, int row, int function);

#endif
