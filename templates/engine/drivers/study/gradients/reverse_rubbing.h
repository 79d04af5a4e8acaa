#ifndef REVERSE_RUBBING_H
#define REVERSE_RUBBING_H

#include "instance.h"

/* contacts_rub at the present point, where the accelerations are known, for weights[n] of its forces: adds to the
   weights unknowns[n + m] and to the sensitivity. */
void reverse_rubbing(const Instance *instance, const double weights[], double unknowns[], Seed *sensitivity);

#endif
