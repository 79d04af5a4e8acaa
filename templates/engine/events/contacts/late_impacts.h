/* Impacts that an importer's solver finds a little late, by the hysteresis of the gap's indicator. */
#ifndef LATE_IMPACTS_H
#define LATE_IMPACTS_H

#include "settling.h"

/* Where nothing but gaps is due, and the importer has found them within their hysteresis: puts time and states back to
   where they were 0, at the accelerations of before. Else the overlap is too deep to tell when, or another event has
   its own time. *late (s) is how far; 0 where nothing was moved. Returns false, with instance->failure, where the
   mechanism cannot be evaluated. */
bool impacts_go_back(Settling *settling, double *late);

/* Lets the instance move on by the time late (s) at the velocities and accelerations of after the impact. The states
   stay where they are if another gap would be overlapped there. */
bool impacts_catch_up(Settling *settling, double late, bool *jumped);

#endif
