/* Impacts that sliding friction causes by itself. */
#ifndef IMPACTS_WITHOUT_COLLISION_H
#define IMPACTS_WITHOUT_COLLISION_H

#include "impacts.h"

/* Impact without collision, where Painleve's paradox leaves no solution for accelerations, or a force without bound: a
   contact that slides while its normal velocity is 0 gets an impulse until its slip has stopped, or has turned so that
   friction no longer pulls the contact in. The others that bear a load take part with restitution 0. The contact is the
   one with the least lever: what an impulse lifts it by, in units of what it would without friction. Genot, Brogliato,
   New results on Painleve paradoxes, Eur. J. Mech. A 1999. False: no contact that slides has so little a lever, or no
   impulse stops its slip. */
bool impacts_without_collision(const ImpactProblem *problem, double most_lever, ImpactResult *result);

#endif
