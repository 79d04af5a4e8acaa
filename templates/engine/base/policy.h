/* Who integrates, and what follows from it. The gate of the FMU chooses one of the two policies when it makes an
   instance; nothing else in the engine asks which kind of FMU it is in. */
#ifndef POLICY_H
#define POLICY_H

#include <stdbool.h>

typedef struct {
    bool integrate; /* solver steps are taken here, and events located in them; without this, another solver's states
                       come with its errors, and events where its search has ended */
    bool stabilise; /* accelerations hold a term that pulls drifting constraints back, see accelerations.h */
    bool remember;  /* where a constraint is about to be lost, the accelerations kept at the end of the last step take
                       its place; without this, those at the start of the running solver step do */
    bool project;   /* solver steps end on the constraints, which places coordinates without mass too; without this,
                       these are solved for whenever they are asked for */
} Policy;

extern const Policy OWN_SOLVER;       /* the instance takes solver steps: co-simulation */
extern const Policy IMPORTERS_SOLVER; /* the instance answers with derivatives: model exchange */

#endif
