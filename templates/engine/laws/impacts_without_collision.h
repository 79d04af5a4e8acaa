/* Impacts that sliding friction causes by itself. */
#ifndef IMPACTS_WITHOUT_COLLISION_H
#define IMPACTS_WITHOUT_COLLISION_H

#include "impacts.h"

/* Impact without collision, where Painleve's paradox leaves no solution for accelerations: contacts that slide while
   their normal velocity is 0 get impulses until the slip has stopped, the others that bear a load take part with
   restitution 0 (Genot, Brogliato, New results on Painleve paradoxes, Eur. J. Mech. A 1999; Glocker, Set-Valued Force
   Laws, 2001). One contact stops if that is enough, the first that can, else all do. False: no impulse stops a slip. */
bool impacts_without_collision(const ImpactProblem *problem, ImpactResult *result);

#endif
