/* Who integrates, and what follows from it. The gate of the FMU chooses one of the two policies when it makes an
   instance; nothing else in the runtime asks which kind of FMU it is in. */
#ifndef POLICY_H
#define POLICY_H

#include <stdbool.h>

typedef struct {
    bool stabilise; /* the accelerations pull constraints back that drift, see accelerations.h */
    bool remember;  /* where a constraint is about to be lost, the accelerations that were kept at the end of the last
                       step lead on; else those at the start of the running solver step do */
    bool project;   /* solver steps end on the constraints, so that what has no mass is where it belongs; else it is
                       solved for whenever it is asked for */
} Policy;

extern const Policy OWN_SOLVER;       /* the instance takes solver steps: co-simulation */
extern const Policy IMPORTERS_SOLVER; /* the instance answers with derivatives: model exchange */

#endif
