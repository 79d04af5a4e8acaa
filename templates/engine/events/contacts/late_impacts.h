/* Impacts that an importer's solver finds late: by the hysteresis of the gap's indicator, or at the end of its step. */
#ifndef LATE_IMPACTS_H
#define LATE_IMPACTS_H

#include "settling.h"

/* Where nothing but gaps is due, and the importer has found them within their hysteresis, or one that was 0 in its last
   step: puts time and states back to where they were 0, at the accelerations of before. Else the overlap is too deep to
   tell when, or another event has its own time. *late (s) is how far; 0 where nothing was moved. Returns false, with
   instance->failure, where the mechanism cannot be evaluated. */
bool impacts_go_back(Settling *settling, double *late);

/* How far below 0 the gap of a contact is, in its unit, if that is deeper than importers find it that locate events;
   else 0. */
double impact_overlap(const Settling *settling, int contact);

/* Is the gap of an open contact below 0, so that the importer would not see it close? */
bool overlaps_unseen(const Settling *settling, int contact);

/* Lets the instance move on by the time late (s) at the velocities and accelerations of after the impact. The states
   stay where they are if another gap would be overlapped there. *met: a surface that has moved on overlaps even so; its
   gaps alone are due then. */
bool impacts_catch_up(Settling *settling, double late, bool *jumped, bool *met);

#endif
